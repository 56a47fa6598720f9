"""Command PRESS, which solves contact, and the outputs that report on it (B §3.3, R110–R125)."""

from __future__ import annotations

from warpjld.script.arguments import Arguments
from warpjld.script.commands.output import ask_for
from warpjld.script.commands.physical import place
from warpjld.script.formats import PICTURES, TABLES, VOLUMES
from warpjld.script.outputs import Table, TactileOutput, Volume
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.specification import SolveSpecification


@command(
    "PRESS",
    syntax=(
        "PRESS <first> <last> [EVERY <frames>] [METHOD <AUGMENTED/PAPER>] [AITKEN] [STOP/CORRECT/RIGID] "
        '[BEARS <pascals>] [STATE "<file>.npz"]'
    ),
    help=(
        "Solve contact. A digit at its force limit (STRENGTH, BEARS) stops; RIGID: ignore limits; "
        "STOP: end there; CORRECT: open it."
    ),
    group="Contact",
)
def press(scene: Scene, arguments: Arguments) -> None:
    """Solve contact at these frames (R110, R113, R118, R120)."""
    first = arguments.integer("the first frame")
    last = arguments.integer("the last frame")
    if last <= first:
        raise arguments.error(f"the last frame must come after the first ({first}), got {last}")
    options = arguments.options(
        every=lambda: arguments.integer("the frames between two that are solved", minimum=1),
        method=lambda: arguments.choice("the method", ("AUGMENTED", "PAPER")).lower(),
        aitken=lambda: True,
        stop=lambda: True,
        correct=lambda: True,
        rigid=lambda: True,
        bears=lambda: arguments.number("the pressure that skin bears in pascals", above=0.0),
        state=lambda: arguments.output_name("the file of the state", (".npz",)),
    )
    if "bears" in options:
        options["pressure"] = options.pop("bears")
    if options.get("aitken") and options.get("method") != "paper":
        raise arguments.error("AITKEN relaxes the paper's loop: it goes with METHOD PAPER")
    if sum(bool(options.get(name)) for name in ("stop", "correct", "rigid")) > 1:
        raise arguments.error("STOP, CORRECT or RIGID, not two of them: each says what to do at the force limit")
    if not (scene.contact.flesh or scene.contact.physical):
        raise arguments.error("nothing deforms: make a body do so with FLESH or PHYSICAL first", arguments.position)
    before = scene.contact.pressing
    if before is not None and before.where is not None:
        raise arguments.error(
            f"line {before.where[1]} asks for frames {before.first} to {before.last} already: one PRESS is enough",
            arguments.position,
        )
    scene.contact.pressing = SolveSpecification(first, last, **options, where=place(arguments))  # type: ignore[arg-type]


@command(
    "TABLE",
    syntax=f'TABLE "<name>{"/".join(TABLES)}"',
    help="A table by frame and digit: contact force, area, peak pressure, reaction of the bones, fraction of the force "
    "limit, sliding.",
    group="Output",
)
def table(scene: Scene, arguments: Arguments) -> None:
    """A table by frame and digit (R95, R118)."""
    ask_for(scene, arguments, Table(arguments.output_name("the table's name", TABLES)))


@command(
    "TACTILE",
    syntax=f'TACTILE "<name>{"/".join((*TABLES, *PICTURES))}" [<actor>]',
    help="Tactile signals of an actor's pads over time: force, centre, area, slip; as a table or as a plot.",
    group="Output",
)
def tactile(scene: Scene, arguments: Arguments) -> None:
    """Tactile signals of an actor's pads over time (R95, R125)."""
    name = arguments.output_name("the name of the table or the plot", (*TABLES, *PICTURES))
    actor = scene.actor(arguments.name("an actor's name")).name if arguments else None
    ask_for(scene, arguments, TactileOutput(name, actor))


@command(
    "VOLUME",
    syntax=f'VOLUME "<name>{"/".join(VOLUMES)}"',
    help="The deformed volumes with their stresses at the frames that PRESS solves, for ParaView.",
    group="Output",
)
def volume(scene: Scene, arguments: Arguments) -> None:
    """The deformed volumes with their stresses at the frames that PRESS solves, for ParaView (R95)."""
    ask_for(scene, arguments, Volume(arguments.output_name("the series' name", VOLUMES)))
