"""Force terms: forces on bodies and joints from outside or between them, each in a file of its own.

A term says everything about itself through a subclass of `ForceTerm`: its items, how they are lowered, the compiled
calls that evaluate them, what they report, and the system without one of them. The equations, the ledger, the channels
and `without` go through `force_terms()`, which finds the files of this folder; nothing else lists them.
"""

from femflex.dynamics.force_terms.registry import ForceTerm, force_terms

__all__ = ["ForceTerm", "force_terms"]
