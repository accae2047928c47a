"""Members that grow and shrink: bodies whose properties follow from a deployed length (THEORY section 6)."""

from femflex.deployment.body import DeployingBody, Reel, deploying_line, deploying_strip, deploying_tapered_line
from femflex.deployment.elements import ElementFunctions
from femflex.deployment.line import DeployingLine, StringFunctions
from femflex.deployment.strip import DeployingStrip, StripFunctions
from femflex.deployment.tapered import MaterialTaper

__all__ = [
    "DeployingBody",
    "DeployingLine",
    "DeployingStrip",
    "ElementFunctions",
    "MaterialTaper",
    "Reel",
    "StringFunctions",
    "StripFunctions",
    "deploying_line",
    "deploying_strip",
    "deploying_tapered_line",
]
