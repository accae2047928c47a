"""Shell members: curved, warped and folded quadrilaterals and triangles with rotations at their nodes."""
