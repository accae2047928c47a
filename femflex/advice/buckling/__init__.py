"""How near what bodies bear comes to what buckles them."""
