// What the player looks like. A page changes the custom properties of `:host`.

export const STYLE = `
:host {
  color-scheme: light dark;
  --accent: light-dark(#2f5fd0, #8fb3ff);
  --surround: light-dark(#eceef2, #0d0f14);
  --panel: light-dark(rgb(255 255 255 / 90%), rgb(24 27 35 / 88%));
  --line: light-dark(rgb(15 20 35 / 12%), rgb(255 255 255 / 12%));
  --text: light-dark(#171b26, #eef1f8);
  --faint: light-dark(#596072, #a3abbd);
  --there-line: light-dark(rgb(15 20 35 / 30%), rgb(255 255 255 / 34%));
  --hover: light-dark(rgb(15 20 35 / 8%), rgb(255 255 255 / 11%));
  --alarm: light-dark(#9a4a00, #ffb86b);
  --alive: light-dark(#c01f35, #ff6b7d);
  display: block;
  position: relative;
  overflow: hidden;
  background: var(--surround);
  color: var(--text);
  font: 14px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif;
  container-type: inline-size;
}
:host([hidden]) { display: none; }
:host([theme="light"]) { color-scheme: light; }
:host([theme="dark"]) { color-scheme: dark; }
* { box-sizing: border-box; }
[hidden] { display: none !important; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none; cursor: grab; outline: none; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { box-shadow: inset 0 0 0 2px var(--accent); }
:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
.panel {
  background: var(--panel);
  border: 1px solid var(--line);
  border-radius: 14px;
  box-shadow: 0 6px 28px rgb(0 0 0 / 16%);
  -webkit-backdrop-filter: blur(18px) saturate(1.3);
  backdrop-filter: blur(18px) saturate(1.3);
}
button, select {
  font: inherit;
  color: inherit;
  border: 0;
  border-radius: 9px;
  background: none;
  min-height: 36px;
}
button { display: inline-grid; place-items: center; min-width: 36px; padding: 0 8px; cursor: pointer; }
button:hover, select:hover { background: var(--hover); }
button[aria-pressed="true"], button[aria-expanded="true"] { color: var(--accent); background: var(--hover); box-shadow: inset 0 -2px var(--accent); }
select { padding: 0 4px; cursor: pointer; text-align: center; }
select option { background: Canvas; color: CanvasText; }
svg { width: 21px; height: 21px; display: block; }

.bar { position: absolute; left: 50%; bottom: max(14px, env(safe-area-inset-bottom)); translate: -50% 0; width: min(760px, calc(100% - 28px)); padding: 8px 10px; }
.keys { display: flex; align-items: center; gap: 2px; }
.time { padding: 0 8px; font-variant-numeric: tabular-nums; white-space: nowrap; }
.time span { color: var(--faint); }
.live { grid-auto-flow: column; gap: 6px; font-weight: 600; color: var(--faint); }
.live::before { content: ""; width: 8px; height: 8px; border-radius: 50%; background: currentColor; }
button.live[aria-pressed="true"] { color: var(--alive); background: none; box-shadow: none; }
.space { flex: 1; }
.timeline { position: relative; padding: 2px 8px 4px; }

input[type="range"] { -webkit-appearance: none; appearance: none; display: block; width: 100%; height: 20px; margin: 0; background: none; cursor: pointer; }
input[type="range"]::-webkit-slider-runnable-track { height: 4px; border-radius: 2px; background: linear-gradient(to right, var(--accent) var(--done, 0%), var(--there-line) var(--done, 0%), var(--there-line) var(--there, 0%), var(--line) var(--there, 0%)); }
input[type="range"]::-moz-range-track { height: 4px; border-radius: 2px; background: linear-gradient(to right, var(--accent) var(--done, 0%), var(--there-line) var(--done, 0%), var(--there-line) var(--there, 0%), var(--line) var(--there, 0%)); }
input[type="range"]::-webkit-slider-thumb { -webkit-appearance: none; width: 16px; height: 16px; margin-top: -6px; border-radius: 50%; background: var(--accent); border: 2px solid light-dark(#fff, #181b23); box-shadow: 0 1px 4px rgb(0 0 0 / 30%); }
input[type="range"]::-moz-range-thumb { width: 12px; height: 12px; border-radius: 50%; background: var(--accent); border: 2px solid light-dark(#fff, #181b23); }

.head { position: absolute; top: max(14px, env(safe-area-inset-top)); left: 14px; right: 14px; display: flex; align-items: flex-start; gap: 10px; pointer-events: none; }
.head > * { pointer-events: auto; }
.title { padding: 7px 13px; font-weight: 600; max-width: 60cqw; overflow: hidden; text-overflow: ellipsis; white-space: nowrap; }
.lost { color: var(--alarm); max-width: min(420px, 70cqw); }
.lost summary { display: flex; align-items: center; gap: 7px; padding: 7px 13px 7px 10px; cursor: pointer; list-style: none; }
.lost summary::-webkit-details-marker { display: none; }
.lost ul { margin: 0; padding: 0 14px 10px 30px; max-height: 30vh; overflow: auto; color: var(--text); font-size: 13px; }
.side { position: absolute; right: 14px; bottom: calc(max(14px, env(safe-area-inset-bottom)) + 100px); width: 280px; display: grid; gap: 10px; max-height: calc(100% - 180px); overflow: auto; }
.side .panel { padding: 12px 14px; box-shadow: none; }
.side h2 { margin: 0 0 6px; font-size: 12px; font-weight: 600; letter-spacing: .02em; color: var(--faint); }
.automatic { width: 100%; margin: 0 0 4px; padding: 6px 8px; text-align: left; font-size: 12px; }
.axis { display: grid; grid-template-columns: 1fr auto; gap: 0 8px; padding: 4px 0; }
.axis input { grid-column: 1 / -1; }
.axis output { font-variant-numeric: tabular-nums; color: var(--faint); }
dl { display: grid; grid-template-columns: 1fr auto; gap: 3px 12px; margin: 0; font-size: 13px; }
dt { color: var(--faint); }
dd { margin: 0; text-align: right; font-variant-numeric: tabular-nums; }
.split { position: absolute; top: 0; bottom: 0; width: 34px; margin-left: -17px; cursor: ew-resize; touch-action: none; border: 0; padding: 0; background: none; border-radius: 0; min-width: 0; }
.split:hover { background: none; }
.split::before { content: ""; position: absolute; inset: 0 auto 0 16px; width: 2px; background: #fff; box-shadow: 0 0 6px rgb(0 0 0 / 60%); }
.split::after { content: "⇔"; position: absolute; top: 50%; left: 0; width: 34px; height: 34px; margin-top: -17px; display: grid; place-items: center; border-radius: 50%; background: #fff; color: #1a1d27; font-size: 16px; box-shadow: 0 1px 8px rgb(0 0 0 / 40%); }
.side-name { position: absolute; bottom: 118px; padding: 4px 10px; font-size: 12px; border-radius: 9px; pointer-events: none; }
.message { position: absolute; inset: 0; display: grid; place-content: center; justify-items: center; gap: 14px; text-align: center; padding: 24px; pointer-events: none; }
.message > * { pointer-events: auto; }
.message p { margin: 0; max-width: 46ch; overflow-wrap: anywhere; }
.message p:not(:empty) { padding: 8px 16px; border-radius: 14px; background: var(--panel); }
.message .open { padding: 8px 18px 8px 12px; grid-auto-flow: column; gap: 8px; border: 1px solid var(--line); background: var(--panel); font-weight: 600; }
.ring { width: 34px; height: 34px; border-radius: 50%; border: 3px solid var(--line); border-top-color: var(--accent); animation: turn 1s linear infinite; }
@keyframes turn { to { rotate: 1turn; } }
.drop { position: absolute; inset: 10px; border: 2px dashed var(--accent); border-radius: 14px; pointer-events: none; }
@media (prefers-reduced-motion: reduce) { .ring { animation-duration: 4s; } }
@media (forced-colors: active) { button[aria-pressed="true"], button[aria-expanded="true"] { outline: 2px solid Highlight; outline-offset: -2px; } }
@container (max-width: 620px) {
  .bar { padding: 6px; width: calc(100% - 16px); bottom: max(8px, env(safe-area-inset-bottom)); }
  input[type="range"] { height: 30px; }
  .wide { display: none; }
  button { min-width: 38px; min-height: 44px; padding: 0 3px; }
  select { width: 58px; padding: 0; min-height: 44px; }
  .time { padding: 0 4px; font-size: 13px; }
  .time span { display: none; }
  .side { left: 14px; right: 14px; width: auto; bottom: calc(max(14px, env(safe-area-inset-bottom)) + 104px); max-height: 52vh; }
  .side:has(> :nth-child(2)) { grid-template-columns: 1fr 1fr; }
}
@container (max-width: 380px) { #info { display: none; } }
@container (max-width: 340px) {
  .keys { gap: 0; }
  button { min-width: 34px; }
  select { width: 52px; }
}
`;
