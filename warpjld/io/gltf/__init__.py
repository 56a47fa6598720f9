"""Reader of glTF 2.0: buffers and nodes (:mod:`document`), arrays (:mod:`accessor`), rigs (:mod:`skin`)."""
