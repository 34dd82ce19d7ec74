"""What is asked of pictures of a board that tell it not themselves."""

import viser

from workbench.extras.camera.camera import ON
from workbench.extras.camera.folder import says_target
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.session_commands import LARGEST_FOLDER, LoadPictures
from workbench.extras.camera.templates import Board
from workbench.views.page.html import LINE, MUTED, text
from workbench.views.page.panels.panel import AbstractPanel, Question, set_value

CARRIERS = {place: mount for mount, place in ON.items()}


ENDING = ".tar,.zip"
"""File types of the upload button, by which the script finds the button's field."""
_SCRIPT = """
(async field => {
  const coder = new TextEncoder(), parts = [];
  const wanted = /\\.(png|jpe?g|bmp|tiff?|pgm|webp|csv|tsv|xlsx|parquet|toml)$/i;
  let folder = 'pictures';
  for (const file of field.files) {
    const way = (file.webkitRelativePath || file.name).split('/');
    if (way.length > 1) folder = way.shift();
    if (!wanted.test(file.name) || way.some(part => part.startsWith('.'))) continue;
    const head = new Uint8Array(512), put = (at, s) => head.set(coder.encode(s).slice(-100), at);
    put(0, way.join('/')); put(100, '0000644'); put(124, file.size.toString(8).padStart(11, '0'));
    put(136, '00000000000'); put(148, '        '); put(156, '0'); put(257, 'ustar'); put(263, '00');
    put(148, head.reduce((a, b) => a + b).toString(8).padStart(6, '0') + '\\0 ');
    parts.push(head, file, new Uint8Array((512 - file.size % 512) % 512));
  }
  parts.push(new Uint8Array(1024));
  const given = new DataTransfer(), place = field.closest('[role=dialog]') ?? document;
  const button = place.querySelector('input[accept="ENDING"]');
  given.items.add(new File(parts, folder + '.tar'));
  button.files = given.files;
  button.dispatchEvent(new Event('change', { bubbles: true }));
  field.value = '';
})(this)
""".replace("ENDING", ENDING)


def folder_field(label: str) -> str:
    """A field, in HTML, on which a folder is dropped or chosen.

    viser's upload button takes one file. A field for folders (`webkitdirectory`) lies over the label; what it
    is given is put into one tar archive in the page, and that archive into the button's own field.
    """
    return (
        '<div data-testid="folder" style="position:relative;margin:2px 12px 8px;padding:14px 10px;'
        f'border:1.5px dashed {LINE};border-radius:6px;text-align:center;font-size:13px;color:{MUTED}">'
        f'{text(label)}<input type="file" webkitdirectory multiple onchange="{text(_SCRIPT)}" '
        f'title="{text(label)}" style="position:absolute;inset:0;width:100%;height:100%;opacity:0;'
        'cursor:pointer"></div>'
    )


class PictureFields:
    """What is asked of a board, and what takes its pictures: in the panel, and on the start card."""

    def __init__(self, panel: AbstractPanel, gui: viser.GuiApi):
        self._side = panel.number(
            "Square [mm]",
            1e3 * Board().square,
            (5.0, 200.0, 0.1),
            "Side of a square, as measured on the print.",
        )
        self._carrier = gui.add_dropdown("Board is", (*CARRIERS,), hint="The camera is on the other.")

    @property
    def board(self) -> Board:
        """One of these squares."""
        return Board(square=1e-3 * float(self._side.value), mounted=CARRIERS[str(self._carrier.value)])

    def show(self, rig: Rig) -> None:
        """The board of pictures that were read."""
        set_value(self._carrier, ON[rig.mounted])
        if (board := rig.targets[0].charuco) is not None:
            set_value(self._side, 1e3 * board.square)

    def build_upload(self, panel: AbstractPanel, gui: viser.GuiApi) -> None:
        """What takes the folder of the pictures, or an archive of it."""
        gui.add_html(folder_field("Drop or choose the folder of the pictures"))
        panel.upload(
            "… or an archive of it (ZIP)",
            lambda name, content: LoadPictures(name, content, self.board),
            "Pictures of a board or of tags, or a table of their corners, and a table of the joints with "
            "a column 'image'. Without target.toml the board's squares are counted in the pictures. Up to "
            f"{LARGEST_FOLDER // 2**20} MiB.",
            endings=ENDING,
            maximum=LARGEST_FOLDER,
            question=Question("Is this the board?", self._assumed, "Read with this board"),
        )

    def _assumed(self, content: bytes) -> str:
        """What is taken for the board of pictures without `target.toml`, as a question."""
        return "" if says_target(content) else f"No target.toml is beside the pictures. {self.board.question}"


def ask_for_pictures(panel: AbstractPanel, gui: viser.GuiApi) -> None:
    PictureFields(panel, gui).build_upload(panel, gui)
