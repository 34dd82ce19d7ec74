"""A field on which a folder is dropped or chosen: the browser packs its files and hands them to a button.

viser's upload button takes one file. A field for folders (`webkitdirectory`) lies over the words; what it is
given is put into one tar archive in the page, and that archive into the button's own field.
"""

from workbench.views.page.html import LINE, MUTED, text

ENDING = ".tar,.zip"
"""What the upload button asks for; by it the script finds the button's field."""
_SCRIPT = """
(async field => {
  const words = new TextEncoder(), parts = [];
  const wanted = /\\.(png|jpe?g|bmp|tiff?|pgm|webp|csv|tsv|xlsx|parquet|toml)$/i;
  let folder = 'pictures';
  for (const file of field.files) {
    const way = (file.webkitRelativePath || file.name).split('/');
    if (way.length > 1) folder = way.shift();
    if (!wanted.test(file.name) || way.some(part => part.startsWith('.'))) continue;
    const head = new Uint8Array(512), put = (at, s) => head.set(words.encode(s).slice(-100), at);
    put(0, way.join('/')); put(100, '0000644'); put(124, file.size.toString(8).padStart(11, '0'));
    put(136, '00000000000'); put(148, '        '); put(156, '0'); put(257, 'ustar'); put(263, '00');
    put(148, head.reduce((a, b) => a + b).toString(8).padStart(6, '0') + '\\0 ');
    parts.push(head, file, new Uint8Array((512 - file.size % 512) % 512));
  }
  parts.push(new Uint8Array(1024));
  const given = new DataTransfer(), button = document.querySelector('input[accept="ENDING"]');
  given.items.add(new File(parts, folder + '.tar'));
  button.files = given.files;
  button.dispatchEvent(new Event('change', { bubbles: true }));
  field.value = '';
})(this)
""".replace("ENDING", ENDING)


def folder_field(words: str) -> str:
    """The field as HTML."""
    return (
        '<div data-testid="folder" style="position:relative;margin:2px 12px 8px;padding:14px 10px;'
        f'border:1.5px dashed {LINE};border-radius:6px;text-align:center;font-size:13px;color:{MUTED}">'
        f'{text(words)}<input type="file" webkitdirectory multiple onchange="{text(_SCRIPT)}" '
        f'title="{text(words)}" style="position:absolute;inset:0;width:100%;height:100%;opacity:0;'
        'cursor:pointer"></div>'
    )
