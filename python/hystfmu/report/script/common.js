// common.js - shared by plots, tables and the explorer.  No library, no request.
const print = v => String(+v.toPrecision(5));

function element(tag, attributes = {}, ...children) {
  const e = document.createElement(tag);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  e.append(...children);
  return e;
}

// a number beside an axis, as in plot.py
function tick(v) {
  const [plain, other] = [String(v), v.toExponential()].map(text => text.replace('e+', 'e'));
  return plain.replace('-', '').length > 5 && other.length < plain.length ? other : plain;
}

// round numbers in [lo, hi]: steps of 1, 2 or 5 times a power of ten, as in plot.py
function ticks([lo, hi], about = 5) {
  const rough = (hi - lo) / about, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough);
  const found = [];
  for (let k = Math.ceil(lo / step); k * step <= hi; k++) found.push(+(k * step).toPrecision(12));
  return found;
}
