//! Look of the page, on screen and on paper.

/// Style sheet. Line colours are vermillion, bluish green and blue of the Okabe-Ito palette: told apart with any
/// colour vision, and each at least 3:1 against white. Dash and fill differ too, so that grey prints stay readable.
pub(super) const CSS: &str = "
:root { --ink: #1f2328; --quiet: #57606a; --rule: #d8dee4; --wash: #f6f8fa;
  --before: #d55e00; --recalibrated: #009e73; --after: #0072b2; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 15px/1.5 system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 20px 20px 48px; }
h1 { font-size: 26px; line-height: 1.25; margin: 2px 0 8px; font-weight: 650; }
h2 { font-size: 20px; margin: 44px 0 12px; padding-bottom: 6px; border-bottom: 2px solid var(--ink); }
h3 { font-size: 16px; margin: 26px 0 8px; }
h4 { font-size: 14px; margin: 14px 0 4px; color: var(--quiet); }
p { margin: 0 0 10px; max-width: 80ch; }
ul { margin: 0; padding-left: 20px; }
code { font: 0.86em ui-monospace, 'SF Mono', Menlo, Consolas, 'DejaVu Sans Mono', monospace; color: var(--quiet);
  font-weight: 400; overflow-wrap: break-word; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }

.verdict { display: flex; gap: 20px; align-items: flex-start; padding: 22px 26px; border-radius: 8px; color: #fff;
  border-left: 10px solid rgba(0, 0, 0, .35); print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.verdict .mark { flex: none; width: 46px; height: 46px; border: 3px solid currentColor; border-radius: 50%;
  font-size: 28px; font-weight: 700; line-height: 38px; text-align: center; }
.verdict .eyebrow { margin: 0; font-size: 13px; opacity: .9; overflow-wrap: anywhere; }
.verdict .summary { margin: 0; font-size: 16px; }
.verdict.consistent { background: #00614a; } .verdict.recalibrate { background: #004f7c; }
.verdict.missing_physics { background: #963f00; } .verdict.unexplained { background: #743a5c; }

table { position: relative; border-collapse: collapse; width: 100%; margin: 4px 0 8px; font-size: 14px; }
caption, .caption { text-align: left; color: var(--quiet); font-size: 14px; padding: 0 0 8px; max-width: none; }
th, td { text-align: left; vertical-align: middle; padding: 5px 12px 5px 0; border-bottom: 1px solid var(--rule); }
thead th { color: var(--quiet); font-size: 13px; font-weight: 600; vertical-align: bottom;
  border-bottom: 1px solid var(--quiet); }
tbody th { font-weight: 400; }
tbody th code { color: var(--ink); }
.proof tbody th code { color: var(--quiet); }
td, dd, svg text { font-variant-numeric: tabular-nums; }
.number { text-align: right; white-space: nowrap; padding-right: 18px; }
table.parameters { width: auto; } table.parameters th, table.parameters td { padding-right: 32px; }
.flag { color: #963f00; font-weight: 600; white-space: nowrap; }

.chain { display: flex; flex-wrap: wrap; gap: 26px; list-style: none; margin: 0 0 20px; padding: 0; }
.part { position: relative; flex: 1 1 180px; display: flex; flex-direction: column; gap: 4px; padding: 10px 12px;
  border: 1px solid var(--rule); border-radius: 6px; font-size: 14px; }
.part:nth-child(-n+2)::after { content: '→'; position: absolute; right: -21px; top: 8px; color: var(--quiet); }
.part .share { color: var(--quiet); font-size: 13px; }
.part.named { border: 2px solid var(--ink); padding: 9px 11px; }
.part .effect { font-weight: 600; } .part .effect::before { content: '• '; }
.bar { display: block; width: 100%; min-width: 110px; height: 8px; }
.track { fill: #e4e8ec; } .filled { fill: var(--ink); }

.card { border: 1px solid var(--rule); border-left: 5px solid var(--ink); border-radius: 6px; padding: 14px 18px;
  margin: 0 0 14px; }
.card h3 { margin: 0 0 4px; font-size: 17px; } .card code { font-size: 13px; }
.card.left { border-left-style: dashed; }
dl.facts { display: flex; flex-wrap: wrap; gap: 4px 36px; margin: 0 0 8px; }
dl.facts dt { color: var(--quiet); font-size: 13px; } dl.facts dd { margin: 0; }
.rivals li { margin-bottom: 4px; }

.key { display: block; padding-top: 6px; color: var(--ink); }
.key svg { vertical-align: -1px; margin: 0 6px 0 18px; } .key svg:first-child { margin-left: 0; }
svg text { font-size: 12px; fill: var(--ink); } svg text.small { font-size: 11px; }
svg text.end { text-anchor: end; } svg text.middle { text-anchor: middle; } svg text.heading { font-weight: 600; }
svg .before, svg .recalibrated, svg .after, svg .measured { fill: none; }
svg .before { stroke: var(--before); } svg .recalibrated { stroke: var(--recalibrated); }
svg .after { stroke: var(--after); } svg .measured { stroke: #8c959f; }
rect.before { fill: #fbe3d2; stroke-dasharray: 3 2; } rect.recalibrated { fill: #fff; } rect.after { fill: var(--after); }
svg .floor { stroke: #000; stroke-width: 2; }
.bars { display: block; width: 100%; min-width: 90px; max-width: 204px; height: 30px; }
.proof tbody th { min-width: 170px; }
.regimes { display: grid; grid-template-columns: repeat(auto-fill, minmax(320px, 1fr)); gap: 18px 24px; }
figure { margin: 0; } figcaption { font-weight: 600; }
.regime figcaption { font-size: 14px; border-bottom: 1px solid var(--rule); margin-bottom: 4px; }
.regime svg { width: 100%; max-width: 400px; }

.map { margin: 0 0 14px; break-inside: avoid; } .map figcaption { font-size: 14px; }
.maps { display: grid; grid-template-columns: repeat(auto-fit, minmax(230px, 1fr)); gap: 4px 16px; }
.maps svg { display: block; width: 100%; max-width: 300px; height: auto; }
path.before { fill: none; stroke: var(--before); stroke-width: 1.5; stroke-dasharray: 5 3; }
path.after { fill: none; stroke: var(--after); stroke-width: 1.5; }
.area { fill: var(--after); fill-opacity: .16; }
.free-form svg { display: block; width: 100%; max-width: 520px; height: auto; margin-top: 6px; }

.trace { margin: 22px 0 30px; } .trace svg { display: block; width: 100%; height: auto; }
polyline, line.before, line.after, line.measured { fill: none; stroke-linejoin: round; }
polyline.measured, line.measured { stroke-width: 3; }
polyline.after, line.after { stroke-width: 1.3; }
polyline.before, line.before { stroke-width: 1.3; stroke-dasharray: 6 3; }
.grid { stroke: #000; stroke-opacity: .09; } .zero { stroke: #000; stroke-opacity: .55; }
.frame { fill: none; stroke: #8c959f; }
.held-out { fill: #000; fill-opacity: .075; }
line.noise { stroke: #000; stroke-width: 1.2; stroke-dasharray: 2 2; }
line.onset { stroke: #000; stroke-width: 1.3; stroke-dasharray: 8 3 2 3; }
text.onset { font-weight: 600; }

#provenance dl { display: grid; grid-template-columns: max-content 1fr; gap: 6px 24px; margin: 0; }
#provenance dt { color: var(--quiet); } #provenance dd { margin: 0; overflow-wrap: anywhere; }
#provenance ul { list-style: none; padding: 0; }

@media print {
  @page { margin: 14mm 12mm; }
  body { font-size: 10pt; }
  table, .part { font-size: 9pt; } thead th, caption, .caption { font-size: 8.5pt; }
  th, td { padding-right: 8px; }
  .regimes { grid-template-columns: repeat(2, 1fr); gap: 12px 24px; }
  .chain { gap: 18px; } .part { flex-basis: 120px; } .part:nth-child(-n+2)::after { right: -17px; }
  .trace { margin: 8px 0 12px; }
  .maps { grid-template-columns: repeat(4, 1fr); gap: 2px 8px; }
  main { max-width: none; padding: 0; }
  .verdict { color: #000; border: 2pt solid #000; border-left-width: 8pt; }
  .verdict.verdict { background: none; }
  h2, h3, h4, p.caption, figcaption, caption, thead { break-after: avoid; }
  .verdict, .card, .part, .trace, .regime, p, tr, #provenance { break-inside: avoid; }
  table, svg { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
@media (max-width: 700px) {
  main { padding: 12px 12px 32px; }
  .verdict { padding: 16px 18px; } .verdict .mark { display: none; } h1 { font-size: 22px; }
  table { display: block; overflow-x: auto; } .caption, caption { display: block; }
  .trace { overflow-x: auto; } .trace svg { min-width: 900px; }
  .free-form { overflow-x: auto; } .free-form svg { min-width: 420px; }
  .part:nth-child(-n+2)::after { content: none; }
  #provenance dl { grid-template-columns: 1fr; }
}
";
