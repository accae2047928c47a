"""What a noun is made of: fields with units and bounds, their readers, names, and the sentences of problems."""
