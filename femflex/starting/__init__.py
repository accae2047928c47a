"""Starting cases: commented cases for a boom, a mesh or a deck, which `femflex new` writes."""
