"""Quasi-static contact simulation over the frames of an animation (B §3.3, §3.4, R91–R130): ``simulate.simulate``.

Data flows one way: a ``specification`` and an ``animation`` are turned into ``bodies``; ``solve`` finds the equilibria
frame by frame and calls ``grip`` for grip searches and corrections; ``report`` and ``display`` make tables, the verdict
and visible surfaces from the results. No module here depends on scripts: results are returned, changes of the animation
as ``AngleEdit``s.

Numeric constants of modules have their units in brackets, none if they are dimensionless; those without a stated
reason or source are assumed.
"""
