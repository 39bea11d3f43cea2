"""The structure of geometric algebras: matrix algebras, groups of versors, Lie algebras of bivectors, null cones."""
