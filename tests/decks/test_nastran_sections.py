"""Sections, materials and axes of Nastran decks in inches: every number against its formula, from generic values."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import read_deck_of_cards

from femflex.mesh.cells import CELL_TYPES

L, F = 0.0254, 0.45359237 * 9.80665  # m, N
MASS = F / L  # kg of one lbf s^2 / in
WT = 0.5  # PARAM,WTMASS
E, G, RHO = 1.0e7, 3.6e6, 2.5e-4
MAT1 = f"MAT1,1,{E},{G},,{RHO}"
NU = E / (2 * G) - 1
A, B = np.array([1.0, 2.0, 0.5]), np.array([4.0, 3.0, 2.5])  # ends of a bar, in inches
ENDS = [f"GRID,1,,{A[0]},{A[1]},{A[2]}", f"GRID,2,,{B[0]},{B[1]},{B[2]}"]
X = (B - A) / np.linalg.norm(B - A)
LENGTH = float(np.linalg.norm(B - A)) * L
V = np.array([0.2, 1.0, 0.3])
Y = (V - (V @ X) * X) / np.linalg.norm(V - (V @ X) * X)
Z = np.cross(X, Y)


def inches(folder, *cards: str, **more: object):
    """The deck of these cards in inches, pounds of force and seconds, masses by WTMASS."""
    every = [line for card in cards for line in card.split("\n")]
    return read_deck_of_cards(
        folder, *every, f"PARAM,WTMASS,{WT}", "PARAM,AUTOSPC,NO", control="ECHO = NONE", units="in-lbf-s", **more
    )


def beam_of(folder, element: str, *cards: str, **more: object):
    (member,) = inches(folder, *ENDS, f"{element},9,3,1,2,{V[0]},{V[1]},{V[2]}", *cards, **more).members
    return member


def positions_and_values(value: object) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and values of a quantity of a section."""
    if isinstance(value, tuple):
        return np.asarray(value[0]), np.asarray(value[1])
    return np.zeros(1), np.array([value], float)


def bends(member, EI1: float, EI2: float, EI12: float) -> None:
    """The bending stiffness as a tensor, int E r r^T dA, is that of the card's axes; in N m^2."""
    y = np.asarray(member.options["orientation"])
    y = (y - (y @ X) * X) / np.linalg.norm(y - (y @ X) * X)
    z = np.cross(X, y)
    computed = float(member.section.EIz) * np.outer(y, y) + float(member.section.EIy) * np.outer(z, z)
    expected = EI1 * np.outer(Y, Y) + EI2 * np.outer(Z, Z) + EI12 * (np.outer(Y, Z) + np.outer(Z, Y))
    assert computed == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def own_axes(member) -> np.ndarray:
    """The axes (2, 2) of the member's section, rows, in those of its card."""
    y = np.asarray(member.options["orientation"])
    y = (y - (y @ X) * X) / np.linalg.norm(y - (y @ X) * X)
    return np.array([[way @ Y, way @ Z] for way in (y, np.cross(X, y))])


def shear_factors(member, K1: float, K2: float) -> np.ndarray:
    """Factors (2,) along the axes of the section: those whose flexibilities are 1/K1 and 1/K2 turned there."""
    return 1 / (own_axes(member) ** 2 @ [1 / K1, 1 / K2])


def test_pbar_numbers(tmp_path):
    card = "PBAR,3,1,.9,.3,.5,.2,.004\n,1.,2.,3.,4.,5.,6.,7.,8.\n,.7,.6,.11"
    member = beam_of(tmp_path, "CBAR", card, MAT1)
    s = member.section
    assert s.EA == pytest.approx(E * 0.9 * F) and s.GJ == pytest.approx(G * 0.2 * F * L**2)
    bends(member, E * 0.3 * F * L**2, E * 0.5 * F * L**2, E * 0.11 * F * L**2)
    assert [s.GAy, s.GAz] == pytest.approx(shear_factors(member, 0.7, 0.6) * G * 0.9 * F) and member.options["shear"]
    m = (RHO * 0.9 + 0.004) * MASS / L * WT
    assert s.mass_per_length == pytest.approx(m)
    polar = RHO * (0.3 + 0.5) * MASS * L * WT  # what the turning of the axes leaves alone
    assert m * (s.ry**2 + s.rz**2) == pytest.approx(polar)
    assert m * s.rz**2 / (polar - m * s.rz**2) == pytest.approx(s.EIz / s.EIy)
    changed = beam_of(tmp_path, "CBAR", card, MAT1, overrides={"pid_3": {"J": 4e-7, "nonstructural_mass": 2.0}})
    assert changed.section.GJ == pytest.approx(G * F / L**2 * 4e-7) and changed.section.EA == pytest.approx(s.EA)
    assert changed.section.mass_per_length == pytest.approx(RHO * 0.9 * MASS / L * WT + 2.0)


PBEAM = (
    "PBEAM,3,1,.9,.3,.5,,.2,.004\n,9.,9.,9.,9.,9.,9.,9.,9.\n"
    ",YES,.4,.8,.25,.45,,.18,.003\n,9.,9.,9.,9.,9.,9.,9.,9.\n"
    ",NO,.7,.7,,.4,,,.002\n,NO,1.,.6,.2,.35,,.1,.001\n"
    ",.7,.6,,,.02\n,.05,.06,,,.12,-.15"
)
AT = [0.0, 0.4, 0.7, 1.0]
STATIONS = {"A": [0.9, 0.8, 0.7, 0.6], "I1": [0.3, 0.25, 0.3, 0.2], "I2": [0.5, 0.45, 0.4, 0.35],
            "J": [0.2, 0.18, 0.2, 0.1], "nsm": [0.004, 0.003, 0.002, 0.001]}  # fmt: skip


def test_pbeam_stations_and_centres(tmp_path):
    """Blank fields of a station are those of end A; NSI is halved between both axes."""
    member = beam_of(tmp_path, "CBEAM", PBEAM, MAT1)
    s, at = member.section, {key: np.array(v) for key, v in STATIONS.items()}
    m = (RHO * at["A"] + at["nsm"]) * MASS / L * WT
    expected = {
        "EA": E * at["A"] * F, "EIz": E * at["I1"] * F * L**2, "EIy": E * at["I2"] * F * L**2,
        "GJ": G * at["J"] * F * L**2, "mass_per_length": m, "GAy": 0.7 * G * at["A"] * F, "GAz": 0.6 * G * at["A"] * F,
        "rz": np.sqrt((RHO * at["I1"] + 0.01) * MASS * L * WT / m),
        "ry": np.sqrt((RHO * at["I2"] + 0.01) * MASS * L * WT / m),
    }  # fmt: skip
    for name, values in expected.items():
        places, computed = positions_and_values(getattr(s, name))
        assert computed == pytest.approx(values, rel=1e-9), name
        assert places == pytest.approx(np.array(AT) * LENGTH), name
    N, M = np.array([0.12, -0.15]) * L, np.array([0.05, 0.06]) * L
    own, more = RHO * 0.9, 0.004
    assert member.options["offset"] == pytest.approx(N) and member.options["shear_centre"] == pytest.approx(-N)
    assert member.options["mass_centre"] == pytest.approx((own * N + more * M) / (own + more) - N)


@pytest.mark.parametrize(
    ("cards", "area", "J", "nsm"),
    [
        (["PROD,3,1,.9,.2,,.004", "CROD,9,3,1,2"], 0.9, 0.2, 0.004),
        (["PTUBE,3,1,1.2,.25,.004", "CTUBE,9,3,1,2"], np.pi * (0.36 - 0.35**2), np.pi / 2 * (0.6**4 - 0.35**4), 0.004),
        (["PTUBE,3,1,1.2", "CTUBE,9,3,1,2"], np.pi * 0.36, np.pi / 2 * 0.6**4, 0.0),
        (["CONROD,9,1,2,1,.9,.2,,.004"], 0.9, 0.2, 0.004),
    ],
)
def test_rod_numbers(tmp_path, cards, area, J, nsm):
    frame = [f"GRID,{g},,{x},0.,7." for g, x in ((5, 0.0), (6, 1.0))]  # bars that give the grids rotations
    frame += [f"CBAR,{80 + k},8,{a},{b},0.,1.,0." for k, (a, b) in enumerate(((1, 5), (5, 6), (6, 2)))]
    deck = inches(tmp_path, *ENDS, *frame, "PBAR,8,1,1.,1.,1.,1.", *cards, MAT1)
    (rod,) = (member for member in deck.members if member.family == "rod")
    assert rod.section.EA == pytest.approx(E * area * F)
    assert rod.section.mass_per_length == pytest.approx((RHO * area + nsm) * MASS / L * WT)
    (twist,) = deck.bushings
    assert list(twist.rotation) == pytest.approx([G * J * F * L**2 / LENGTH, 0.0, 0.0]) and not np.any(
        twist.translation
    )


OFFSETS = ["CORD2R,5,0,0.,0.,0.,0.,1.,0.", ",0.,0.,1.", "CORD2R,6,0,0.,0.,0.,1.,0.,0.", ",0.,1.,0."]
CFIVE = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]])  # rows: x along z, z along y
CSIX = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0.0]])


@pytest.mark.parametrize("codes", ["", "GGO", "GOG", "BOO", "GGG"])
def test_bar_offsets(tmp_path, codes):
    """The vector of the bar lies in the system of end A, or in basic axes by B."""
    ends = ["GRID,1,,1.,2.,.5,5", "GRID,2,,4.,3.,2.5,6"]
    a, b = np.array([0.1, -0.3, 0.2]), np.array([-0.2, 0.15, 0.4])
    v = V if codes.startswith("B") else CFIVE @ V
    card = f"CBAR,9,3,1,2,{v[0]},{v[1]},{v[2]},{codes}\n,,,{a[0]},{a[1]},{a[2]},{b[0]},{b[1]},{b[2]}"
    deck = inches(tmp_path, *OFFSETS, *ends, card, "PBAR,3,1,.9,.3,.5,.2", MAT1)
    own = np.array([X, Y, Z])
    at = [A + a @ (own if codes[1:2] == "O" else CFIVE), B + b @ (own if codes[2:3] == "O" else CSIX)]
    computed = deck.mesh.points[deck.mesh.cells["line"][0]]
    assert computed == pytest.approx(np.array(at) * L)
    y = np.asarray(deck.members[0].options["orientation"])
    assert y == pytest.approx(V / np.linalg.norm(V))
    ties = {
        deck.mesh.group_points(connection.group)[0]: deck.mesh.group_points(connection.reference)[0]
        for connection in deck.connections
    }
    rows = deck.mesh.cells["line"][0]
    assert [ties[r] for r in rows] == [deck.points_of_ids[1], deck.points_of_ids[2]]


PLANE = np.array([[0.98, 0.1, 0.17], [-0.2, 0.95, 0.24]])
CORNERS = np.array([[0.0, 0.0], [2.0, 0.3], [2.2, 1.5], [0.1, 1.3]]) @ PLANE + [0.3, 0.2, 0.7]
MIDDLES = (CORNERS + np.roll(CORNERS, -1, axis=0)) / 2
NORMAL = np.cross(PLANE[0], PLANE[1]) / np.linalg.norm(np.cross(PLANE[0], PLANE[1]))
QUAD = [f"GRID,{k + 1},,{x[0]:.9f},{x[1]:.9f},{x[2]:.9f}" for k, x in enumerate(CORNERS)]
SIDES = [f"GRID,{k + 5},,{x[0]:.9f},{x[1]:.9f},{x[2]:.9f}" for k, x in enumerate(MIDDLES)]
MAT8 = "MAT8,8,2.+7,1.5+6,.28,7.+5,6.+5,4.+5,1.4-4"
Q8 = np.array([[2e7, 0.28 * 1.5e6, 0], [0.28 * 1.5e6, 1.5e6, 0], [0, 0, 0]]) / (1 - 0.28**2 * 1.5 / 20)
Q8[2, 2] = 7e5
Q1 = np.array([[E, NU * E, 0], [NU * E, E, 0], [0, 0, G * (1 - NU**2)]]) / (1 - NU**2)
Q2 = np.array([[9e6, 2e6, 3e5], [2e6, 7e6, -2e5], [3e5, -2e5, 3e6]])
MAT2 = "MAT2,2,9.+6,2.+6,3.+5,7.+6,-2.+5,3.+6,3.-4"
Q4 = np.array([[3e5, 1e5, 0], [1e5, -2e5, 0], [0, 0, 1e5]])
MAT4 = "MAT2,4,3.+5,1.+5,0.,-2.+5,0.,1.+5"


@pytest.mark.parametrize("mids", ["1281", "8124", "2114"])
def test_pshell_stiffness_of_four_materials(tmp_path, mids):
    """12 I / T^3 = 1.4, T_S / T = 0.7, nonstructural mass; MID4 couples."""
    T = 0.2
    fields = f"PSHELL,3,{mids[0]},{T},{mids[1]},1.4,{mids[2]},.7,6.-6\n,,,{'4' if mids[3] == '4' else ''}"
    deck = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", fields, MAT1, MAT8, MAT2, MAT4)
    s = deck.members[0].section
    Q, rho = {"1": Q1, "2": Q2, "8": Q8}, {"1": RHO, "2": 3e-4, "8": 1.4e-4}[mids[0]]
    shear = {"1": G * np.eye(2), "2": Q2[:2, :2], "8": np.diag([6e5, 4e5])}[mids[2]]
    assert s.A == pytest.approx(Q[mids[0]] * T * F / L, abs=1e-6 * E * T * F / L)
    assert s.D == pytest.approx(Q[mids[1]] * T**3 / 12 * 1.4 * F * L, abs=1e-9 * E * T**3 * F * L)
    assert s.S == pytest.approx(shear * 0.7 * T * F / L)
    assert s.B == pytest.approx(-Q4 * T**2 * F if mids[3] == "4" else np.zeros((3, 3)))
    assert s.mass == pytest.approx((rho * T + 6e-6) * MASS / L**2 * WT) and s.added == pytest.approx(
        6e-6 * MASS / L**2 * WT
    )
    assert s.rotary == pytest.approx(rho * T**3 / 12 * MASS * WT) and s.thickness == pytest.approx(T * L)
    values = {"thickness": 0.004, "bending_ratio": 2.0, "shear_ratio": 0.3, "nonstructural_mass": 1.5}
    if mids[3] != "4":
        changed = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", fields, MAT1, MAT8, MAT2, MAT4,
                         overrides={"pid_3": values}).members[0].section  # fmt: skip
        t = 0.004
        assert changed.D == pytest.approx(Q[mids[1]] * F / L**2 * t**3 / 6, abs=1e-9 * E * F / L**2 * t**3)
        assert changed.S == pytest.approx(shear * F / L**2 * t * 0.3)
        assert changed.mass == pytest.approx(rho * MASS / L**3 * WT * t + 1.5)


def laminate(plies: list[tuple[np.ndarray, float, float, float]], z0: float):
    """A, B, D, mass, height of its centre and rotary inertia of plies (Q, density, thickness, degrees), in inches."""
    A, B, D = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    m = np.zeros(3)
    z = z0
    for Q, rho, t, degrees in plies:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
        own = T.T @ Q @ T
        up = z + t
        A, B, D = A + own * t, B + own * (up**2 - z**2) / 2, D + own * (up**3 - z**3) / 3
        m += rho * np.array([t, (up**2 - z**2) / 2, (up**3 - z**3) / 3])
        z = up
    centre = m[1] / m[0]
    return A, B, D, m[0], centre, m[2] - m[0] * centre**2


LAYERS = [(Q8, 1.4e-4, 0.05, 30.0), (Q8, 1.4e-4, 0.08, -45.0), (Q1, RHO, 0.02, 0.0), (Q1, RHO, 0.02, 10.0)]


@pytest.mark.parametrize(
    ("card", "plies", "z0"),
    [
        ("PCOMP,3,.03,6.-6\n,8,.05,30.,,,.08,-45.\n,1,.02,0.,,,,10.", LAYERS, 0.03),
        ("PCOMP,3,-.05,6.-6,,,,,SYM\n,8,.05,30.,,,.08,-45.\n,1,.02,0.,,,,10.", LAYERS + LAYERS[::-1], -0.05),
        ("PCOMP,3,,6.-6\n,8,.05,30.,,,.08,-45.\n,1,.02,0.,,,,10.", LAYERS, -0.085),
        ("PCOMPG,3,.03,6.-6\n,11,8,.05,30.\n,12,8,.08,-45.\n,13,1,.02,0.\n,14,1,.02,10.", LAYERS, 0.03),
    ],
)
def test_laminates_by_ply_sums(tmp_path, card, plies, z0):
    deck = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", card, MAT1, MAT8)
    s, (A, B, D, m, centre, rotary) = deck.members[0].section, laminate(plies, z0)
    assert s.A == pytest.approx(A * F / L, abs=1e-9 * np.abs(A).max() * F / L)
    assert s.B == pytest.approx(B * F, abs=1e-9 * np.abs(A).max() * F * 0.1)
    assert s.D == pytest.approx(D * F * L, abs=1e-9 * np.abs(D).max() * F * L)
    assert s.mass == pytest.approx((m + 6e-6) * MASS / L**2 * WT)
    assert s.centre == pytest.approx(centre * L, abs=1e-9) and s.rotary == pytest.approx(rotary * MASS * WT)
    if "SYM" not in card:
        changed = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", card, MAT1, MAT8,
                         overrides={"pid_3": {"thickness_2": 0.11 * L}}).members[0].section  # fmt: skip
        other = [plies[0], (*plies[1][:2], 0.11, plies[1][3]), *plies[2:]]
        A = laminate(other, z0)[0]
        assert changed.A == pytest.approx(A * F / L, abs=1e-9 * np.abs(A).max() * F / L)


ELEMENTS = {  # with THETA (or MCID), ZOFFS, and a thickness of each corner
    "CQUAD4": "CQUAD4,9,3,1,2,3,4,{theta},{offset}\n,,{flag},{t[0]},{t[1]},{t[2]},{t[3]}",
    "CQUADR": "CQUADR,9,3,1,2,3,4,{theta},{offset}\n,,{flag},{t[0]},{t[1]},{t[2]},{t[3]}",
    "CTRIA3": "CTRIA3,9,3,1,2,3,{theta},{offset}\n,,{flag},{t[0]},{t[1]},{t[2]}",
    "CTRIAR": "CTRIAR,9,3,1,2,3,{theta},{offset}\n,,{flag},{t[0]},{t[1]},{t[2]}",
    "CQUAD8": "CQUAD8,9,3,1,2,3,4,5,6\n,7,8,{t[0]},{t[1]},{t[2]},{t[3]},{theta},{offset}\n,{flag}",
    "CTRIA6": "CTRIA6,9,3,1,2,3,5,6,20\n,{theta},{offset},{t[0]},{t[1]},{t[2]},{flag}",
}
MORE = ["GRID,20,,{:.9f},{:.9f},{:.9f}".format(*((CORNERS[0] + CORNERS[2]) / 2))]
DIRECTION = ["CORD2R,5,0,0.,0.,0.,.3,.2,.9", ",1.,.5,0.", "CORD2C,6,0,5.,-4.,0.,5.,-4.,1.", ",6.,-4.,0."]


@pytest.mark.parametrize("relative", [False, True])
@pytest.mark.parametrize("name", ELEMENTS)
def test_shell_thickness_offset_and_angle(tmp_path, name, relative):
    """One corner has no thickness of its own: it has that of the property."""
    t = ["1.1", "", "1.5", "1.7"] if relative else [".11", "", ".15", ".17"]
    card = ELEMENTS[name].format(theta="25.", offset=".05", t=t, flag="1" if relative else "")
    shell = "PSHELL,3,8,.2,8,,8"
    deck = inches(tmp_path, *QUAD, *SIDES, *MORE, card, shell, MAT8)
    (member,) = deck.members
    side = (CORNERS[1] - CORNERS[0]) / np.linalg.norm(CORNERS[1] - CORNERS[0])
    a = np.radians(25.0)
    expected = np.cos(a) * side + np.sin(a) * np.cross(NORMAL, side)
    assert member.options["offset"] == pytest.approx(0.05 * L)
    assert member.options["axis"] == pytest.approx(expected, abs=1e-7)
    given = [0.2 * 1.1, 0.2, 0.2 * 1.5, 0.2 * 1.7] if relative else [0.11, 0.2, 0.15, 0.17]
    (thickness,) = member.options["thickness"].values()
    corners = 3 if "TRIA" in name else 4
    assert np.ravel(thickness) == pytest.approx(np.array(given[:corners]) * L)


SOLIDS = {
    "CTETRA": "tetra10", "CPYRAM": "pyramid13", "CPENTA": "wedge15", "CHEXA": "hexahedron20",
}  # fmt: skip
PLACES = {
    "CTETRA": [[0, 0, 0], [1.1, 0, 0.1], [0.2, 1, 0], [0.1, 0.2, 1.3]],
    "CPYRAM": [[0, 0, 0], [1.1, 0, 0], [1.1, 1.2, 0], [0, 1.2, 0], [0.3, 0.4, 1.3]],
    "CPENTA": [[0, 0, 0], [1.1, 0, 0.1], [0.2, 1, 0], [0.1, 0, 1.3], [1.3, 0.1, 1.5], [0.3, 1.1, 1.2]],
    "CHEXA": [[0, 0, 0], [1.1, 0, 0.1], [1.3, 1, 0], [0.1, 1.2, 0.1], [0, 0.1, 1.3], [1.2, 0, 1.5], [1, 1.1, 1.4],
     [0, 1, 1.2]],
}  # fmt: skip
EDGES = {  # as the figures of the manual number the middles of sides
    "CTETRA": "12 23 31 14 24 34", "CPYRAM": "12 23 34 41 15 25 35 45", "CPENTA": "12 23 31 14 25 36 45 56 64",
    "CHEXA": "12 23 34 41 15 26 37 48 56 67 78 85",
}  # fmt: skip


@pytest.mark.parametrize("some", [False, True])
@pytest.mark.parametrize("name", SOLIDS)
def test_middle_nodes_of_solids(tmp_path, name, some):
    """All given, or every third left out, which are then put in the middle."""
    x = np.array(PLACES[name], float)
    edges = [(int(e[0]) - 1, int(e[1]) - 1) for e in EDGES[name].split()]
    numbers = [k + 1 for k in range(len(x))]
    places = list(x)
    for k, (a, b) in enumerate(edges):
        if some and k % 3 == 1:
            numbers.append(0)
            continue
        places.append((x[a] + x[b]) / 2)
        numbers.append(len(places))
    words = [name, "9", "3", *(str(n) if n else "" for n in numbers)]
    card = "\n".join(",".join(["" if k else words[0], *words[1 + k : 9 + k]]) for k in range(0, len(words) - 1, 8))
    grids = [f"GRID,{k + 1},,{p[0]},{p[1]},{p[2]}" for k, p in enumerate(places)]
    deck = inches(tmp_path, *grids, card, "PSOLID,3,1", f"MAT1,1,{E},,.3,{RHO}")
    ((kind, cells),) = deck.mesh.cells.items()
    assert kind == SOLIDS[name]
    cell, own = CELL_TYPES[kind], deck.mesh.points[cells[0]]
    assert own[: cell.n_corners] == pytest.approx(x * L)
    for j, parents in enumerate(cell.parents, cell.n_corners):
        assert own[j] == pytest.approx(own[parents].mean(axis=0), abs=1e-12)


def mat9(C: np.ndarray) -> str:
    """Card of a matrix in the order 11, 22, 33, 12, 23, 31."""
    words = ["MAT9", "1", *(f"{C[i, j]:.9g}" for i in range(6) for j in range(i, 6)), str(RHO)]
    return "\n".join(",".join(["" if k else words[0], *words[1 + k : 9 + k]]) for k in range(0, len(words) - 1, 8))


def test_mat9_entries(tmp_path):
    rng = np.random.default_rng(4)
    A = rng.standard_normal((6, 6))
    C = (A @ A.T + 6 * np.eye(6)) * 1e6
    grids = [f"GRID,{k + 1},,{p[0]},{p[1]},{p[2]}" for k, p in enumerate(PLACES["CTETRA"])]
    deck = inches(tmp_path, *grids, "CTETRA,9,3,1,2,3,4", "PSOLID,3,1", mat9(C))
    own, card = ["11", "22", "33", "23", "13", "12"], ["11", "22", "33", "12", "23", "13"]
    at = [card.index(name) for name in own]
    assert np.asarray(deck.members[0].material.C) == pytest.approx(C[np.ix_(at, at)] * F / L**2, rel=1e-7)
    assert deck.members[0].material.density == pytest.approx(RHO * MASS / L**3 * WT)


@pytest.mark.parametrize("name", ["CTETRA", "CHEXA"])
@pytest.mark.parametrize("system", [-1, 5, 6])
def test_axes_of_solid_materials(tmp_path, name, system):
    x = np.array(PLACES[name], float)
    grids = [f"GRID,{k + 1},,{p[0]},{p[1]},{p[2]}" for k, p in enumerate(x)]
    words = [name, "9", "3", *map(str, range(1, len(x) + 1))]
    card = "\n".join(",".join(["" if k else words[0], *words[1 + k : 9 + k]]) for k in range(0, len(words) - 1, 8))
    C = np.diag([5.0, 4.0, 3.0, 1.0, 1.1, 1.2]) * 1e6
    deck = inches(tmp_path, *DIRECTION, *grids, card, f"PSOLID,3,1,{system}", mat9(C))
    computed = np.reshape(deck.members[0].options["axes"], (2, 3))
    if system == 5:
        z = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
        first = np.array([1.0, 0.5, 0.0]) - (np.array([1.0, 0.5, 0.0]) @ z) * z
        second = np.cross(z, first)
    elif system == 6:
        first = (x.mean(axis=0) - [5.0, -4.0, 0.0]) * [1, 1, 0]
        second = np.cross([0, 0, 1.0], first)
    else:  # from the face of low r to that of high r; the second towards high s
        first, s = x[1] - x[0], x[2] - x[0]
        if name == "CHEXA":
            first = x[[1, 2, 5, 6]].sum(axis=0) - x[[0, 3, 4, 7]].sum(axis=0)
            s = x[[2, 3, 6, 7]].sum(axis=0) - x[[0, 1, 4, 5]].sum(axis=0)
        second = s - (s @ first) / (first @ first) * first
    expected = [v / np.linalg.norm(v) for v in (first, second)]
    assert computed == pytest.approx(np.array(expected), abs=1e-9)


@pytest.mark.parametrize(
    ("card", "values"),
    [
        (f"MAT1,1,{E},,.3,{RHO}", (E, E / 2.6, 0.3)),
        (f"MAT1,1,{E},{G},,{RHO}", (E, G, E / (2 * G) - 1)),
        (f"MAT1,1,,{G},.2,{RHO}", (2.4 * G, G, 0.2)),
        (f"MAT1,1,{E},{G},.2,{RHO}", (E, G, 0.2)),
    ],
)
def test_two_elastic_constants_give_the_third(tmp_path, card, values):
    e, g, nu = values
    p = F / L**2
    deck = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", "PSHELL,3,1,.2,1,,1", card)
    s = deck.members[0].section
    assert s.A[0, 0] == pytest.approx(e * p / (1 - nu**2) * 0.2 * L) and s.A[2, 2] == pytest.approx(g * p * 0.2 * L)
    assert s.A[0, 1] / s.A[0, 0] == pytest.approx(nu) and s.S[1, 1] == pytest.approx(5 / 6 * g * p * 0.2 * L)
    assert deck.moduli == pytest.approx((e * p,)) and deck.densities == pytest.approx((RHO * MASS / L**3 * WT,))
    changed = inches(tmp_path, *QUAD, "CQUAD4,9,3,1,2,3,4", "PSHELL,3,1,.2,1,,1", card,
                     overrides={"mat_1": {"E": 5e10, "nu": 0.1}}).members[0].section  # fmt: skip
    assert changed.A[2, 2] == pytest.approx(5e10 / 2.2 * 0.2 * L)
