"""The page's style sheet: what viser's own has no setting for. It relies on how viser 1.1 builds its page;
where that differs, the page is as viser makes it. A browser test holds it.

A browser looks for what `:has` names whenever something like it comes or goes below an element that may have
it, and styles anew all that the rule reaches from there. So it names one attribute or class that hardly
anything has, and stands in no rule for what is always there: every number that changes would cost a look at
the whole panel (5 to 10 ms).
"""

import json

import viser

from workbench.views.appearance.colours import SELECTED, SKY, SKY_DARK, css
from workbench.views.page.viser_internals import run_script

PANEL_WIDTH, WIDE_SHARE = 470, 0.25
"""Width of the panel [px], and in wide windows its share of them."""
ROOM = f"max({PANEL_WIDTH}px, {100 * WIDE_SHARE:g}vw)"
PANEL = 'div[style*="grid-template-rows"] > div'
STRIP = f"{PANEL} > div > div > .mantine-Paper-root[data-with-border]:nth-child(2)"
"""The panel's first folder, behind this sheet; it is kept in view."""
INSIDE = f"{STRIP} > div > div > div"
"""What holds its parts."""
TABS = f'{PANEL} [role="tablist"]'
"""The list of the tabs; it is kept in view below the strip, whose height a script measures."""
SHEET_OPEN = '[style*="grid-template-rows: 1fr"] [data-testid="hint"]'
SHEET = f'.mantine-Paper-root[style*="position: fixed"] {SHEET_OPEN}'
"""On a phone: the strip in a panel that is open, over the lower part of the window."""
NARROW = 1000
"""Windows up to this width have a narrower panel [px]."""
WIDE = 1900
"""… and from this one on the words are larger [px]."""
PHONE = 576
"""… and up to this one the panel is a sheet over its lower part, as viser makes it [px]."""
PHONE_SCENE = 40
"""The scene's share of a phone's height above it [%]; viser gives a long panel the rest, too."""
DRAWINGS = "suspects, index, losses, verdict, row-chart, result, curves"
CHARTS = ", ".join(f'[data-testid="{name}"]' for name in DRAWINGS.split(", "))
"""What holds drawings of 340 units, whose words are as large as those around them."""
ONLY_TRACK = 'data-track="1"'
"""Stands before a slider whose number is said elsewhere."""
CAPTION = 'data-caption="1"'
"""Marks what is said over the scene."""
MESSAGE = 'data-message="1"'
"""Marks the last message."""
RULES = f"""
:root[data-mantine-color-scheme="light"] {{
  --mantine-color-dimmed: #5f6770 !important; --mantine-color-gray-filled: #5c636a !important;
  --mantine-color-gray-filled-hover: #495057 !important;
  --mantine-color-custom-filled: #2563eb !important; --mantine-color-custom-filled-hover: #1d4ed8 !important;
  --mantine-color-custom-outline: #1d4ed8 !important; --mantine-color-custom-text: #1d4ed8 !important;
  --mantine-primary-color-filled: #2563eb !important }}
:root[data-mantine-color-scheme="dark"] {{
  --mantine-color-dimmed: #a9b0b7 !important; --mantine-color-gray-filled: #5c636a !important;
  --mantine-color-gray-filled-hover: #6c757d !important; --mantine-color-custom-text: #8ab4ff !important;
  --mantine-color-custom-filled: #2f66dd !important; --mantine-color-custom-outline: #8ab4ff !important;
  --mantine-primary-color-filled: #2f66dd !important }}
.mantine-Slider-markLabel, .multi-slider-mark-label {{
  font-size: 12px !important; color: var(--mantine-color-dimmed) !important }}
.mantine-Button-root[data-disabled] {{ color: var(--mantine-color-dimmed) !important }}
[role="tab"][aria-selected="true"] {{ color: var(--mantine-color-custom-text) !important }}
.mantine-Button-label, .mantine-Text-root[style*="0.875em"], .mantine-Input-input,
.mantine-Paper-root > .mantine-Paper-root {{ font-size: max(12px, .875em) !important }}
[{CAPTION}] {{ position: fixed; z-index: 5; bottom: 22px; left: 0; width: calc(100vw - {ROOM});
  box-sizing: border-box; padding: 0 max(16px, calc(50vw - 330px - 0.5 * {ROOM}));
  text-align: center; font-size: 19px; line-height: 1.4; pointer-events: none }}
[{CAPTION}] > div {{ background: color-mix(in srgb, var(--mantine-color-body) 96%, transparent);
  color: var(--mantine-color-text); padding: 8px 16px }}
[{CAPTION}] > [data-testid="caption"] {{ box-sizing: content-box; min-height: 2.8em }}
[{CAPTION}] > .figure {{ font-size: 30px; font-weight: 650; padding-bottom: 0;
  font-variant-numeric: tabular-nums }}
[{CAPTION}] > a {{ display: inline-block; margin-top: 10px; padding: 5px 16px; border-radius: 4px;
  background: #1d4ed8; color: #fff; font-size: 15px; text-decoration: none; pointer-events: auto }}
.mantine-Notifications-root {{ z-index: 4 !important; top: auto !important; bottom: 1em;
  left: 1em !important }}
.mantine-Notification-root {{ pointer-events: none !important }}
.mantine-Notification-root button {{ pointer-events: auto !important }}
canvas[data-engine] {{ background: {css(SKY)} }}
[data-mantine-color-scheme="dark"] canvas[data-engine] {{ background: {css(SKY_DARK)} }}
{PANEL}[style*="overflow: hidden"] {{ overflow: clip !important; min-width: 0 }}
{STRIP} {{ position: sticky; top: 0; z-index: 20; margin: -12px 0 .6em; border-width: 0 0 1px;
  border-radius: 0; background: var(--mantine-color-body); box-shadow: 0 4px 8px -6px rgba(0,0,0,.3) }}
{STRIP} > .mantine-Paper-root, {STRIP} > :last-child {{ display: none }}
{INSIDE} {{ display: flex; flex-wrap: wrap; gap: 6px 0; padding: 6px 0 9px !important }}
{INSIDE} > * {{ flex: 1 0 100%; padding-bottom: 0 !important }}
{STRIP} [data-testid="hint"] {{ min-height: calc(5.8em + 2px); box-sizing: border-box }}
{INSIDE} > [style*="contain: layout"] {{ position: absolute; inset: auto 0 0; padding: 0 !important }}
div:has(> [{MESSAGE}]) {{ position: sticky; bottom: 0; z-index: 18; padding: 4px 0 6px;
  background: var(--mantine-color-body) }}
{INSIDE} > [style*="margin-inline"] {{ flex: 1 1 40% }}
{PANEL} div[style*="min-height: 2.4em"] {{ overflow: clip !important }}
{TABS} {{ position: sticky; top: var(--strip, 0px); z-index: 19;
  background-color: var(--mantine-color-body) }}
.typing .mantine-Tooltip-tooltip {{ display: none !important }}
.mantine-ScrollArea-scrollbar[data-orientation="vertical"] {{
  width: 8px !important; padding: 0 1px !important }}
.gone, .phone {{ display: none }}
.mantine-Modal-body div:has(> [accept]) {{ position: relative }}
.mantine-Modal-body input[type="file"] {{ display: block !important; position: absolute;
  inset: 0; width: 100%; opacity: 0; z-index: 1; cursor: pointer }}
div[style*="pointer-events: none"][style*="opacity: 0.5"] .gone {{ display: block }}
div:has(> [{ONLY_TRACK}]) + div .mantine-NumberInput-root {{ display: none }}
.mantine-Input-wrapper:not([data-with-right-section]) > .mantine-NumberInput-input {{
  padding-inline: 2px !important }}
div:has(> [{ONLY_TRACK}]) + div .mantine-Slider-root {{ margin: 0 1.2em 1.2em .5em }}
{CHARTS} {{ container-type: inline-size }}
@container (min-width: 420px) {{ svg[viewBox^="0 0 340"] text {{ font-size: 10px }} }}
@media (min-width: {WIDE}px) {{
  :root {{ --words: clamp(14px, 0.66vw, 18px) }}
  .mantine-Button-label, .mantine-Text-root[style*="0.875em"], .mantine-Input-input, [role="tab"],
  .mantine-Paper-root > .mantine-Paper-root {{ font-size: 14px !important }}
}}
@media (max-width: {NARROW}px) {{
  [{CAPTION}] {{ width: calc(100vw - max(340px, 42vw)); padding: 0 12px; font-size: 16px }}
  [{CAPTION}] > .figure {{ font-size: 22px }}
  .mantine-Notifications-root {{ top: 1em !important; bottom: auto }}
  [role="tab"] {{ padding: .6em .35em !important; font-size: 12px }}
  [data-with-right-section] > .mantine-NumberInput-input {{ padding-inline: .1em 1.5em !important }}
}}
@media (max-width: {PHONE}px) {{
  [{CAPTION}] {{ width: 100vw; font-size: 14px }}
  body:has({SHEET}) [{CAPTION}] {{ bottom: {100 - PHONE_SCENE}vh; padding: 0 }}
  body:has({SHEET}) [{CAPTION}] > [data-testid="caption"], .wide {{ display: none }}
  [{CAPTION}] > .figure, [{CAPTION}] > a, [{CAPTION}] > .phone {{ display: inline-block;
    margin: 0; padding: 3px 8px; font-size: 14px }}
  .phone {{ display: inline-block !important }}
  body:has({SHEET}) div:has(> div > canvas) {{ height: {PHONE_SCENE}vh !important }}
  .mantine-Paper-root[style*="position: fixed"]:has({SHEET_OPEN}) {{
    min-height: {100 - PHONE_SCENE}vh !important }}
  .mantine-Paper-root[style*="width: 20em"], [style*="width: 20em"] {{ width: 100% !important }}
}}
"""
ENDED = (
    '<div class="gone" style="margin:0 12px 12px;padding:4px 10px;border-left:3px solid #dc2626;'
    'font-size:13px">'
    "The workbench has stopped, or this page can't reach it. Restart it and reload the page; continue a "
    "recorded session with <code>workbench serve --session FOLDER</code>.</div>"
)
"""Shown while the page has no connection."""
COARSE = 0.4
"""Pixels that are drawn for one of the page's while a hand moves something and the processor draws."""
SLOW = "llvmpipe|swiftshader|softpipe|software"
"""In the names of renderers without a graphics card."""
LABEL = "vec4(0.76, 0.79, 0.83, 0.8 * vAlpha)"
"""Ground of the scene's labels, in place of viser's white: it suits light and dark pages."""
LEAVE = ["Close", "Cancel", "Look around", "Back"]
"""Buttons that end a sheet without doing anything."""
SCRIPT = f"""
if (matchMedia("(prefers-color-scheme: dark)").matches)  // until the server is told and paints it so
  document.documentElement.dataset.mantineColorScheme = "dark";
const compiled = WebGL2RenderingContext.prototype.shaderSource;  // labels would stand out white in the dark
WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {{
  compiled.call(this, shader, text.replace("vec4(1.0, 1.0, 1.0, 0.85 * vAlpha)", "{LABEL}"));
}};
const measured = new ResizeObserver(([strip]) =>
  document.documentElement.style.setProperty("--strip", `${{strip.target.offsetHeight}}px`));
let strip = null, tab = "", list = null, scrolled = null;
const places = {{}};
const tabs = () => [...document.querySelectorAll({f'{TABS} [role="tab"]'!r})];
const turned = () => {{
  const all = tabs(), open = all.find(one => one.ariaSelected === "true");
  if (!open || all.length < 2 || window.wanted || list !== open.parentElement) return;
  if (open.innerText === tab) return;
  tab = open.innerText;
  if (window.tabs?.[tab]) new Image().src = window.tabs[tab];
  const at = places[tab];
  const put = () => {{ if (scrolled) scrolled.scrollTop = at === undefined ? 0 : at + strip.offsetHeight; }};
  put();
  requestAnimationFrame(put);
}};
const press = () => {{  // the tab that the program opens, or that a panel made anew, as on a phone, forgot
  const all = tabs(), open = all.find(one => one.ariaSelected === "true");
  if (!open || all.length < 2) return;
  if (list !== open.parentElement) window.wanted ||= tab;
  list = open.parentElement;
  const next = all.find(one => one.innerText === window.wanted);
  window.wanted = "";
  if (!next || next === open) return;
  for (const kind of ["pointerdown", "pointerup", "click"])  // where tabs can be dragged, a click is nothing
    next.dispatchEvent(new PointerEvent(kind, {{ bubbles: true, button: 0, isPrimary: true }}));
}};
new MutationObserver(turned).observe(document, {{ subtree: true, attributeFilter: ["aria-selected"] }});
addEventListener("scroll", e => {{
  if (!strip || !e.target.contains(strip) || window.wanted) return;
  scrolled = e.target;
  // what is seen stays where the strip grows by a line, as the browser keeps it; the top stays the top
  places[tab] = scrolled.scrollTop > 0 ? scrolled.scrollTop - strip.offsetHeight : undefined;
}}, true);
setInterval(() => {{
  const found = document.querySelector({STRIP!r});
  if (found && found !== strip) measured.observe(strip = found);
  press();
  turned();
  for (const note of document.querySelectorAll(".mantine-Notification-root"))
    if (note.innerText.includes("File uploaded successfully")) note.style.display = "none";
}}, 300);
addEventListener("change", e => {{
  const [maximum, address] = window.limits?.[e.target.id?.replace("file_upload_", "")] ?? [Infinity, ""];
  if (!([...e.target.files ?? []].some(file => file.size > maximum))) {{
    if (e.target.type === "file") setTimeout(() => e.target.value = "");  // the same file can be given again
    return;
  }}
  e.stopImmediatePropagation();
  e.target.value = "";
  new Image().src = address;
}}, true);
const heading = document.createElement("h1");
heading.style = "position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%);margin:0";
document.body.prepend(heading);
const icons = {{"list-search": "All commands", adjustments: "Settings of the page"}};
const name = (control, words) => control.setAttribute("aria-label", words);
setInterval(() => {{
  for (const part of document.querySelectorAll(
      ".mantine-Slider-root, .mantine-NumberInput-root, .mantine-TextInput-root, .mantine-Textarea-root")) {{
    const own = [...part.querySelectorAll("[role=slider], input, textarea")]
      .filter(e => (!e.ariaLabel || e.ariaLabel === e.dataset.named) && !e.labels?.length);
    const row = own.length ? part.closest("div:has(> div > .mantine-Text-root label)") : null;
    const words = row?.querySelector("label").innerText;
    for (const control of own) if (words) name(control, control.dataset.named = words);  // labels change
    for (const [k, control] of part.querySelectorAll("button:not([aria-label])").entries())
      name(control, k ? "Less" : "More");
  }}
  heading.textContent = document.title;
  document.querySelector("div:has(> canvas[data-engine])")?.setAttribute("role", "main");
  const panel = strip?.closest({PANEL!r});
  if (panel) [panel.role, panel.ariaLabel] = ["region", "Panel"];
  for (const icon of document.querySelectorAll("button:not([aria-label]):has(> .mantine-ActionIcon-icon)"))
    name(icon, icon.closest("[aria-label]")?.ariaLabel
      ?? icons[icon.querySelector("svg")?.classList[1]?.replace("tabler-icon-", "")] ?? "Button");
  for (const link of document.querySelectorAll("svg a")) {{
    const chart = link.closest("svg");
    if (!chart.contains(document.activeElement)) link.tabIndex = link === chart.querySelector("a") ? 0 : -1;
  }}
}}, 1000);
addEventListener("pointermove", () => document.body.classList.remove("typing"));
addEventListener("click", e => {{ if (e.target.matches(".mantine-Select-input")) e.target.select(); }});
addEventListener("keydown", e => {{
  document.body.classList.add("typing");  // hints of what is under a pointer at rest would cover the tabs
  const link = /^Arrow(Left|Right)$/.test(e.key) && e.target.closest?.("svg a");
  if (link) {{
    const all = [...link.closest("svg").querySelectorAll("a")];
    const next = all[all.indexOf(link) + (e.key === "ArrowRight" ? 1 : -1)];
    if (next) [link.tabIndex, next.tabIndex] = [-1, 0];
    next?.focus();
    e.preventDefault();
  }}
  if (e.key !== "Escape") return;
  const sheet = [...document.querySelectorAll(".mantine-Modal-content")].at(-1);
  const leave = [...sheet?.querySelectorAll("button") ?? []];
  leave.find(b => {LEAVE}.includes(b.innerText.trim()))?.click();
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
"""Every tab keeps where it is scrolled to, and the server is told which is open. What is typed into a list
replaces what was chosen. Screen readers get names and landmarks. A page without a graphics card draws a sixth
of its pixels while a hand moves something."""


def configure_pages(server: viser.ViserServer) -> None:
    """Give a server's pages their style, their panel and no light, before the first of them comes.

    Another light means that a page compiles every shader again, and another width of the panel that it draws
    the scene anew. An environment map would take half of a computer's time that draws by itself.
    """
    server.scene.configure_environment_map(None)
    server.scene.configure_default_lights(False)
    paint(server.gui)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(PANEL_WIDTH)
    server.gui.add_html(f"<style>{RULES}</style>{ENDED}")
    run_script(server.gui, SCRIPT)


def paint(gui: viser.GuiApi, *, is_dark: bool = False) -> None:
    """Colour the pages of this interface."""
    gui.configure_theme(show_logo=False, show_share_button=False, brand_color=SELECTED, dark_mode=is_dark)


def name_pages(server: viser.ViserServer, robot: str) -> None:
    """Name the browsers' tabs after the program and the arm on its page."""
    run_script(server.gui, f"document.title = {json.dumps(f'workbench – {robot}')};")
