"""Reader of OpenUSD: stages (:mod:`stage`), joint trees (:mod:`skeletons`), meshes (:mod:`mesh`), :mod:`skin`."""
