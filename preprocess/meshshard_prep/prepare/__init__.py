"""Steps that change the mesh which is stored: weld, largest_component, orient, simplify. See docs/preparing.md."""
