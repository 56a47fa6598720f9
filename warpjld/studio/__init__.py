"""A studio in the browser: a script made with mouse and keyboard, seen as it is made.

``state`` holds all there is: a document (the script), the scene it describes, a frame. It knows nothing of browsers.
``panels`` show it by viser, and change it by nothing but edits of the document.
"""
