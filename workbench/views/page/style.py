"""The page's style sheet: what viser's own has no setting for. It relies on how viser 1.1 builds its page;
where that differs, the page is as viser makes it. A browser test holds it.

A browser looks for what `:has` names whenever something like it comes or goes below an element that may have
it, and styles anew all that the rule reaches from there. So it names one attribute or class that hardly
anything has, and stands in no rule for what is always there: every number that changes would cost a look at
the whole panel (5 to 10 ms).
"""

import viser

from workbench.views.appearance.colours import SKY, SKY_DARK, css
from workbench.views.page.viser_internals import run_script

PANEL_WIDTH = 470
"""Width of the panel [px]."""
PANEL = 'div[style*="grid-template-rows"] > div'
STRIP = f"{PANEL} > div > div > .mantine-Paper-root[data-with-border]:nth-child(2)"
"""The panel's first folder, behind this sheet; it is kept in view."""
INSIDE = f"{STRIP} > div > div > div"
"""What holds its parts."""
SHEET = (
    '.mantine-Paper-root[style*="position: fixed"] [style*="grid-template-rows: 1fr"] [data-testid="hint"]'
)
"""On a phone: the strip in a panel that is open, over the lower part of the window."""
NARROW = 1000
"""Windows up to this width have a narrower panel [px]."""
WIDE = 'data-wide="1"'
WIDEST = 620
"""Marks what makes its modal as wide as the window; a narrower one scrolls [px]."""
MORE = 'data-more="1"'
"""Marks what is hidden in a narrow window."""
OVER = 'data-over="1"'
OVER_HEIGHT = 152
"""Marks curves with a slider over them, where a click or drag sets the time; their height [px]."""
RULES = f"""
canvas[data-engine] {{ background: {css(SKY)} }}
[data-mantine-color-scheme="dark"] canvas[data-engine] {{ background: {css(SKY_DARK)} }}
.mantine-Modal-content:has([{WIDE}]) {{ flex-basis: 94vw; max-width: 1800px }}
[{WIDE}] {{ overflow-x: auto }}
[{WIDE}] svg {{ max-height: 76vh; min-width: {WIDEST}px }}
{PANEL}[style*="overflow: hidden"] {{ overflow: clip !important }}
{STRIP} {{ position: sticky; top: 0; z-index: 20; margin: 0 0 .6em; border-width: 0 0 1px;
  border-radius: 0; background: var(--mantine-color-body); box-shadow: 0 4px 8px -6px rgba(0,0,0,.3) }}
{STRIP} > .mantine-Paper-root, {STRIP} > :last-child {{ display: none }}
{INSIDE} {{ display: flex; flex-wrap: wrap; gap: 6px 0; padding: 6px 0 !important }}
{INSIDE} > * {{ flex: 1 0 100%; padding-bottom: 0 !important }}
{INSIDE} > [style*="margin-inline"] {{ flex: 1 1 0 }}
.gone {{ display: none }}
[{OVER}] {{ height: {OVER_HEIGHT}px; margin-bottom: -{OVER_HEIGHT}px }}
div:has(> [{OVER}]) + div {{ height: {OVER_HEIGHT}px; padding: 0 12px !important; position: relative }}
div:has(> [{OVER}]) + div :is(.mantine-Slider-bar, .mantine-Slider-markWrapper, .mantine-NumberInput-root),
div:has(> [{OVER}]) + div div:has(> .mantine-Text-root) {{ display: none }}
div:has(> [{OVER}]) + div .mantine-Slider-root {{
  padding: 0 !important; margin-top: {OVER_HEIGHT // 2 - 4}px !important }}
div:has(> [{OVER}]) + div .mantine-Slider-trackContainer::before {{
  content: ""; position: absolute; inset: -{OVER_HEIGHT // 2 - 4}px 0; cursor: col-resize }}
div:has(> [{OVER}]) + div .mantine-Slider-track::before {{ display: none }}
div:has(> [{OVER}]) + div .mantine-Slider-thumb {{
  width: 2px !important; height: {OVER_HEIGHT}px !important; border: 0; border-radius: 0 }}
.mantine-Modal-body div:has(> [accept]) {{ position: relative }}
.mantine-Modal-body input[type="file"] {{ display: block !important; position: absolute;
  inset: 0; width: 100%; opacity: 0; z-index: 1; cursor: pointer }}
div[style*="pointer-events: none"][style*="opacity: 0.5"] .gone {{ display: block }}
@media (max-width: {NARROW}px) {{
  [{MORE}] {{ display: none }}
  [role="tab"] {{ padding: .6em .35em !important; font-size: 12px }}
}}
@media (max-width: 767px) {{
  body:has({SHEET}) div:has(> div > canvas) {{ height: 41vh !important }}
  .mantine-Paper-root[style*="width: 20em"], [style*="width: 20em"] {{ width: 100% !important }}
}}
"""
ENDED = (
    '<div class="gone" style="margin:0 12px;padding:4px 10px;border-left:3px solid #dc2626;font-size:13px">'
    "The workbench has stopped, or this page can't reach it. Restart it and reload the page; continue a "
    "recorded session with <code>workbench serve --session FOLDER</code>.</div>"
)
"""Shown while the page has no connection."""


COARSE = 0.4
"""Pixels that are drawn for one of the page's while a hand moves something and the processor draws."""
SLOW = "llvmpipe|swiftshader|softpipe|software"
"""In the names of renderers without a graphics card."""
SCRIPT = f"""
document.title = "workbench";
let held = null;
addEventListener("focusin", e => {{
  held = e.target.matches?.('input[inputmode="decimal"]') ? [e.target, e.target.value] : null;
}}, true);
addEventListener("focusout", e => {{
  if (!held || e.target !== held[0] || e.target.value !== "") return;
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(e.target, held[1]);
  e.target.dispatchEvent(new Event("input", {{ bubbles: true }}));
}}, true);
const settings = () => window.__viserTestpoints?.devSettings;
const slow = canvas => {{
  const gl = canvas.getContext("webgl2"), info = gl?.getExtension("WEBGL_debug_renderer_info");
  return info ? /{SLOW}/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : false;
}};
let at = null, before;
addEventListener("pointerdown", e => {{ if (e.target.matches("canvas[data-engine]")) at = e; }}, true);
addEventListener("pointermove", e => {{
  if (!at || before !== undefined || Math.hypot(e.x - at.x, e.y - at.y) < 4 || !settings()) return;
  if (!slow(at.target)) return void (at = null);
  before = settings().get().fixedDpr;
  settings().set({{fixedDpr: {COARSE} * (before ?? devicePixelRatio)}});
}}, true);
const end = () => {{
  at = null;
  if (before !== undefined) settings()?.set({{fixedDpr: before}});
  before = undefined;
}};
for (const name of ["pointerup", "pointercancel"]) addEventListener(name, end, true);
addEventListener("blur", end);  // the window's alone: a control that was pressed before loses its focus too
"""
"""A field for a number that is left blank, as letters leave it, shows its number again. While a hand moves
the scene or a handle, a page without a graphics card draws a sixth of its pixels."""


def configure_pages(server: viser.ViserServer) -> None:
    """Give a server's pages their style, their panel and no light, before the first of them comes.

    Another light means that a page compiles every shader again, and another width of the panel that it draws
    the scene anew. An environment map would take half of a computer's time that draws by itself.
    """
    server.scene.configure_environment_map(None)
    server.scene.configure_default_lights(False)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(PANEL_WIDTH)
    server.gui.add_html(f"<style>{RULES}</style>{ENDED}")
    run_script(server, SCRIPT)
