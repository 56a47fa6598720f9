"""The studio: an editor for scripts in the browser, with a 3D view of the scene that the script describes.

``state`` is the model, independent of browsers: a document (the script), its scene, the current frame, a selection.
``panels`` are the views, made with viser; they change the state only by edits of the document.
"""
