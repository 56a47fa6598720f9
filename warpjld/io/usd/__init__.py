"""Reading OpenUSD: stages (:mod:`stage`), joint trees (:mod:`skeletons`), meshes (:mod:`mesh`), rigs (:mod:`skin`)."""
