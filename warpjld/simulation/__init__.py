"""Contact simulated over the frames of an animation (B §3.3, §3.4, R91–R130): ``simulate.simulate``.

Data flow one way: a ``specification`` and an ``animation`` become ``bodies``; ``solve`` finds equilibria frame by frame
and asks ``grip`` for grips and corrections; ``display`` and ``report`` show and tell what came of it. No module here
knows scripts: what is found comes back as results, and edits of the animation as ``AngleEdit``s.
"""
