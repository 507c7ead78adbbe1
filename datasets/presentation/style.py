"""How a report looks."""

CSS = """
:root { --ink: #1d2733; --quiet: #5d6874; --line: #e3e7ec; --paper: #ffffff; --wash: #f6f8fa; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--wash); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 22px 20px 60px; }
header p { margin: 0; color: var(--quiet); }
h1 { font-size: 22px; margin: 0; }
h2 { font-size: 18px; margin: 34px 0 10px; }
h3 { font-size: 14.5px; margin: 18px 0 6px; }
video { max-width: 100%; border-radius: 6px; }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 16px 18px;
  margin: 12px 0; }
section > h2:first-child { margin-top: 0; }
.headline { font-size: 19px; line-height: 1.4; font-weight: 600; margin: 14px 0 12px; }
.cards { display: flex; flex-wrap: wrap; gap: 12px; margin: 12px 0; }
.card { flex: 1 1 220px; background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  border-top: 5px solid var(--colour); padding: 10px 14px; }
.card h3 { margin: 0 0 4px; font-size: 15px; }
.card .big { font-size: 27px; font-weight: 700; line-height: 1.15; }
.card small { color: var(--quiet); display: block; }
.panels { display: grid; gap: 14px; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); }
.panels.small { grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); margin-top: 14px; }
.panels.wide { grid-template-columns: 1fr; }
.panels img { width: 100%; height: auto; display: block; }
.panels figcaption { margin: 4px 0; overflow-wrap: anywhere; }
.panels strong { color: var(--ink); font-size: 13.5px; }
.panels.small strong { font-size: 12.5px; }
.legend { display: flex; flex-wrap: wrap; gap: 2px 16px; margin: 0 0 6px; font-size: 13px; }
.legend i { display: inline-block; width: 11px; height: 11px; border-radius: 50%; margin-right: 6px; }
h1, h3, .headline, .legend { overflow-wrap: anywhere; }
td:first-child { overflow-wrap: break-word; min-width: 96px; max-width: 240px; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 5px 10px 5px 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { color: var(--quiet); font-weight: 600; }
td.detected { font-weight: 700; }
td small { display: block; color: var(--quiet); font-weight: 400; font-size: 11px; }
td:not(:first-child) small { white-space: nowrap; }
td.quiet, .quiet { color: var(--quiet); }
.wide { overflow-x: auto; }
ul { margin: 6px 0; padding-left: 20px; }
li { margin: 4px 0; }
li.detected::marker { color: #0072b2; content: "●  "; }
li.caution::marker { content: "!  "; font-weight: 700; color: #d55e00; }
.pictures { display: flex; flex-wrap: wrap; gap: 10px; }
figure { margin: 0; } figcaption { font-size: 12px; color: var(--quiet); }
details summary { cursor: pointer; color: var(--quiet); }
@media (max-width: 900px) { main { padding: 14px 10px 40px; } section { padding: 12px; }
  table { font-size: 12px; } th, td { padding: 4px 7px 4px 0; } td small { font-size: 10px; }
  .panels { grid-template-columns: 1fr; } .panels.small { grid-template-columns: 1fr 1fr; } }
@media print { body { background: #fff; } section, .card { break-inside: avoid; } }
"""
