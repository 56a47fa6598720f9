"""``python -m warpjld``: the command line."""

from warpjld.cli import main

main()
