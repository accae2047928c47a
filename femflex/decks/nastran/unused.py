"""Cards that the structure ignores, with the consequence of each in plain words."""

from __future__ import annotations

import re

from femflex.decks.findings import BY_MATRICES
from femflex.decks.nastran.bulk import Bulk

# Pattern of the start of a card's name -> consequence; the first match is used.
CONSEQUENCES = (
    (r"CGAP|PGAP", "contact is left out; the gap stays open"),
    (r"BSURF|BCTSET|BCTADD|BCTPARM|BCONP|BCBODY|BCTABLE|BGSET|BGADD|BCPROP|BEDGE|BLSEG|BCRPARA|BCAUTOP",
     "contact and glue are left out; the surfaces do not touch"),
    (r"CWELD|CFAST|CSEAM|PWELD|PFAST|PSEAM", "fasteners are left out; the parts that they join stay apart"),
    (r"CVISC|PVISC|CDAMP|PDAMP", "damping is left out; give damping in the case"),
    (r"MAT[45]$", "heat conduction is left out"),
    (r"MAT10$", "fluid elements are left out; the mass of the fluid is missing"),
    (r"MATS1|MATHP", "the material stays linear; plasticity and hyperelasticity are left out"),
    (r"MATT\d", "dependence on temperature is left out; the values of the material itself are used"),
    (r"PLOTEL|SNORM|DVGRID", "nothing is left out of the structure"),
    (r"DMIG|DMI$|DMIJ|DMIK|K2GG|M2GG|DTI$", "matrices are left out; their stiffness and mass are missing"),
    (r"ASET|OMIT|BSET|CSET|QSET|USET|BNDFIX|BNDFREE|SESET|SECSET|SEBSET|SEQSET|EXTRN|RELEASE",
     "reductions are left out; choose the reduction in the case"),
    (r"CYJOIN|CYSYM|CYSUP|CYAX", "cyclic symmetry is left out; stiffness and mass of the other sectors are missing"),
    (r"SUPORT", "free bodies are reduced by the case (method = 'free_free')"),
    (r"EIGR|EIGRL|EIGB|EIGC|EIGP", "choice of modes is left out; the case says how many"),
    (r"FORCE|MOMENT|PLOAD|LOAD|ACCEL|RFORCE|SLOAD|TEMP|DLOAD|RLOAD|TLOAD|DAREA|LSEQ|DEFORM|TIC|SPCD|DELAY|DPHASE|RANDPS|RANDT",
     "loads and temperatures of these cards are left out; give them in the case"),
    (r"FREQ|TSTEP|TABD|TABL|TABR|TABS|TABE|TF$|NLPARM|NLPCI|RSPEC|RCROSS|TSTEPNL|EPOINT|NOLIN",
     "choices of an analysis are left out; the case has its own"),
    (r"CAERO|PAERO|AERO|AEROS|SPLINE|AESTAT|AELIST|AESURF|AEFACT|AECOMP|AEPARM|AELINK|FLFACT|FLUTTER|MKAERO|TRIM|GUST"
     r"|DIVERG|MONPNT|MONDSP|CSSCHD|PANLST|SURFGRD|ATTACH|CMARGIN|VSET|NLFLTR|FLSYM|BODY7|ACOORD|PAFOIL|CSPL",
     "aerodynamics is left out"),
    (r"DESVAR|DVPREL|DVCREL|DVMREL|DRESP|DCONSTR|DCONADD|DEQATN|DOPTPRM|DLINK|DSCREEN|DTABLE|DESGRID|DVSHAP|DVBSHAP"
     r"|BNDGRID|TOPVAR|DVAR|DOPTPR|BEADVAR|DVGEOM|TOMVAR", "optimisation is left out; the values of the deck are used"),
    (r"CHBDY|PHBDY|CONV|PCONV|RADBC|RADM|QBDY|QVECT|QVOL|QHBDY|VIEW|RADSET|RADLST|RADMTX|CELAST|BDYOR|PRADM",
     "heat transfer is left out"),
    (r"CHACAB|CHACBR|PACABS|PACBAR|CAABSF|ACSRCE|PANEL|ACMODL|SLOT|FLSYM|FSLIST|PRESPT|RINGFL|GRIDB|GRIDF|FREEPT"
     r"|CFLUID|MFLUID|PAABSF|CAXIF|CSLOT|BDYLIST|AXIF|FLSYM|RING|AXIC|AXSLOT|POINTAX|PRESAX",
     "acoustics and fluids are left out; the mass of the fluid is missing"),
    (r"ROTORG|ROTORB|ROTOR|RGYRO|RSPINR|RSPINT|UNBALNC|RSPIN", "rotor dynamics is left out; the case has spins"),
    (r"BCRPARA|SEEXCLD|SEBULK|SELOC|SEMPLN|SECONCT|SETREE|SELABEL|SEUSET|SENQSET|SEUPTF|BEGIN|CSUPER|CSUPEXT|SEELT|SELOAD",
     "superelements are left out; their stiffness and mass are missing"),
    (r"BOLT|BOLTFOR|BOLTLD|BOLTSEQ|BOLTADD", "bolt preload is left out"),
    (r"MODTRAK|MATTC|ECHOON|ECHOOFF|ENDDATA|CORD|PARAM|OUTPUT|ECHO|CEND|SOL|TITLE|OUTRCV|STOCHAS|BLDOUT|POINT|CBARAO|PBMN"
     r"|SEQGP|DYNRED|RVDOF|RCONN|GUST|BLSEG|MDLPRM|GMNURB|GMCURV|FEEDGE|FEFACE|ADAPT|GMBNDC|OUTGRID|CPARAM"
     r"|TABDMP|SET2|CNGRNT|SWLDPRM|AMLREG|CONCHK|DEBUG|RBESET", "nothing is left out of the structure"),
)  # fmt: skip
# Elements with stiffness or mass that are not read: the model would be wrong without them.
ESSENTIAL = re.compile(
    r"(GENEL|CBEAM3|CBEND|CTRIAX|CQUADX|CTRAX|CCONEAX|CTRAPRG|CTRIARG|CTORDRG|CTRAPAX|CTRIAAX|CRAC|CIHEX|CIS2D"
    r"|CTRBSC|CTRPLT|CQDPLT|CTRIM6|CTWIST|CTRSHL|CDUM|CRIGD|CQUAD[12]$|CTRIA[12]$|CQDMEM|CTRMEM|CHEXA[12]$|CWEDGE|RSPLINE"
    r"|RTRPLT|RJOINT|RSSCON|CIFHEX|CIFPENT|CACINF|CQUAD$|CTRIA$|CPLSTN|CPLSTS|CMBEAM|CMBAR|CELBOW|CHEX20|CHEX8|CTETRA[A-Z]"
    r"|CHEXA[A-Z]|CCRSFIL|CBELT|CSPR)"
)
PROPERTY_OR_MATERIAL = re.compile(r"(P[A-Z0-9]+|MAT[A-Z0-9]*)$")
# Pattern of an element that is not read -> the cards that may take its place.
IN_PLACE = (
    (r"CBEAM3|CBEND", "CBEAM"),
    (r"CRIGD", "RBE2"),
    (r"CQUAD[12]|CQDMEM|CQDPLT|CTRIA[12]|CTRMEM|CTRBSC|CTRPLT|CTRIM6", "CQUAD4 or CTRIA3 on PSHELL"),
    (r"CHEXA[12]|CIHEX|CWEDGE", "CHEXA or CPENTA on PSOLID"),
)


def report_unused(bulk: Bulk) -> None:
    """Report every unused card with its consequence; unsupported elements are problems."""
    reported = {entry.card for entry in bulk.findings.left_out}
    for name, cards in bulk.cards.items():
        if (
            bulk.findings.used.get(name, 0)
            or name in reported
            or any(entry.startswith(name + " ") for entry in reported)
        ):
            continue
        first = cards[0]
        if name in READ_CARDS:
            continue
        if ESSENTIAL.match(name):
            others = next((f"give {cards} in its place, or " for text, cards in IN_PLACE if re.match(text, name)), "")
            bulk.findings.problem(
                f"{len(cards)} {name}, the first {first}: there is no such element here, and the model would be wrong "
                f"without them; {others}{BY_MATRICES}", first.location,
            )  # fmt: skip
            continue
        for pattern, consequence in CONSEQUENCES:
            if re.match(pattern, name):
                bulk.findings.unused(name, consequence, first.location, len(cards))
                break
        else:
            if PROPERTY_OR_MATERIAL.match(name):
                bulk.findings.unused(name, "no element of the structure uses it", first.location, len(cards))
            else:
                bulk.findings.unused(name, "is not a known card and is left out", first.location, len(cards))


# Cards that are read, although none may be counted as used.
READ_CARDS = {
    "GRID", "GRDSET", "SPOINT", "CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S", "PARAM", "ENDDATA",
    "MPCADD", "MPC", "SPC", "SPC1", "SPCADD", "BAROR", "SET1", "SET3",
}  # fmt: skip
