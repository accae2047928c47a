"""Members that grow and shrink: bodies whose properties follow from a deployed length (THEORY section 6)."""

from femflex.deployment.body import deploying_line
from femflex.deployment.line import DeployingLine, StringFunctions

__all__ = ["DeployingLine", "StringFunctions", "deploying_line"]
