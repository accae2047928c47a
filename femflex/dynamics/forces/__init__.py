"""Forces on all bodies: of motion, strain and gravity; the calls of force terms; and the motion of the base frame."""
