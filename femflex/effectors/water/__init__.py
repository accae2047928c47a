"""Water around bodies: its motion by current and waves, and its forces and added mass on members, cables and bodies."""
