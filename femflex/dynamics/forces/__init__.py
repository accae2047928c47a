"""Forces on all bodies: of motion, strain and gravity; force terms, each in its own file; motion of the base frame."""
