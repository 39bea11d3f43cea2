"""What geometric algebras are made of: matrix algebras, groups of versors, Lie algebras of bivectors, null cones."""
