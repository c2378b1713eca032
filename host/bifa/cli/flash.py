"""`bifa flash`: write the firmware to the Uno, and check that it answers."""

from collections.abc import Callable
from typing import Annotated

import typer

from bifa.cli._options import port_option
from bifa.computer import EXAMPLE_PORT
from bifa.screen import Console

EXAMPLES = ("bifa flash", f"bifa flash --port {EXAMPLE_PORT}", "bifa flash --build-only")


def flash(
    port: Annotated[str | None, port_option("The Uno's serial port (default: detected).")] = None,
    build_only: Annotated[bool, typer.Option("--build-only", help="Build the image but do not write it.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show the full output of the tools.")] = False,
) -> None:
    """Write the firmware to the Uno, and check that it answers.

    In a clone of the repository, PlatformIO builds and writes it; elsewhere, avrdude writes the image that comes with
    this installation.

    Vent the supplies first: while the bootloader runs, the valve pins float, and only the gates' pull-downs
    keep the valves off.
    """
    from bifa.firmware import carried_image
    from bifa.link import Uno
    from bifa.rig import open_rig
    from bifa.toolchain import build_image, choose_port, find_project, project_folder, upload_image, write_with_avrdude

    console = Console()
    # a tool that fails shows its output anyway
    on_line: Callable[[str], None] = console.out if verbose else lambda _: None
    project = project_folder() if build_only else find_project()
    chosen = None if build_only else choose_port(port)
    if project is not None:
        with console.status("building"):
            image = build_image(project, on_line)
        console.print(f"built {image.relative_to(project)}")
        if chosen is not None:
            choose_port(chosen)  # building takes long enough for another program to open it
    if chosen is None:
        return
    with console.status(f"writing to {chosen}"):
        try:
            if project is not None:
                upload_image(project, chosen, on_line)
            else:
                write_with_avrdude(carried_image(), chosen, on_line)
        except KeyboardInterrupt:
            console.print("interrupted: the Uno may hold half an image; run `bifa flash` again")
            raise
    with console.status("waiting for the firmware"), open_rig(chosen) as rig, Uno(rig.transport, rig.clock) as uno:
        hello = uno.connect()
    console.print(f"firmware {hello.firmware} answers on {chosen}")
