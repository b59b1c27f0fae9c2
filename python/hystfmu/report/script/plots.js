// plots.js - hover, zoom and linked cursors of plots.
// plot.py draws them: data-x and data-y of an <svg> are the ranges of the axes, data-label is the label of x; a curve
// is a path in tenths of a point with its name in data-name.
const SVG = 'http://www.w3.org/2000/svg';
function drawn(tag, attributes, parent) {
  const e = document.createElementNS(SVG, tag);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  return parent.appendChild(e);
}

const cursors = []; // of all plots, to link those with the same x

function plot(svg, number) {
  const ends = name => svg.dataset[name].split(' ').map(Number);
  const whole = {x: ends('x'), y: ends('y')};
  let view = {...whole};
  const log = 'log' in svg.dataset, plain = (v, digits) => log ? +(10 ** v).toPrecision(digits) : v;
  const frame = svg.querySelector('.frame'), side = name => +frame.getAttribute(name);
  const left = side('x'), top = side('y'), wide = side('width'), high = side('height');
  const axes = svg.querySelector('.axes'), output = element('output');
  const caption = svg.parentNode.querySelector('figcaption');
  (caption || svg.parentNode).append(output);
  const px = v => left + (v - view.x[0]) * wide / (view.x[1] - view.x[0]);
  const py = v => top + high - (v - view.y[0]) * high / (view.y[1] - view.y[0]);
  const vx = p => view.x[0] + (p - left) * (view.x[1] - view.x[0]) / wide;
  const vy = p => view.y[0] + (top + high - p) * (view.y[1] - view.y[0]) / high;

  // curves as numbers, clipped by the frame
  const clip = drawn('clipPath', {id: `clip${number}`}, svg);
  drawn('rect', {x: left, y: top, width: wide, height: high}, clip);
  const group = drawn('g', {'clip-path': `url(#clip${number})`}, svg);
  const lines = [...svg.querySelectorAll('[data-name]')].map(path => {
    group.append(path);
    const d = path.getAttribute('d').match(/-?\d+/g).map(Number), points = [];
    for (let k = 0, x = 0, y = 0; k < d.length; k += 2) {
      x += d[k], y += d[k + 1];
      points.push([vx(x / 10), vy(y / 10)]);
    }
    const onward = points.every((p, k) => !k || p[0] >= points[k - 1][0]);
    const mark = drawn('circle', {r: 4, class: `mark ${path.classList[1]}`, visibility: 'hidden'}, svg);
    return {path, points, onward, name: path.dataset.name, mark};
  });
  const rule = drawn('path', {class: 'rule', visibility: 'hidden'}, svg);
  const box = drawn('rect', {class: 'box', visibility: 'hidden'}, svg);
  const functions = lines.every(l => l.onward);

  function draw() {
    const size = ([a, b]) => b - a, kx = size(whole.x) / size(view.x), ky = size(whole.y) / size(view.y);
    const to = [px(whole.x[0]) - left * kx, py(whole.y[0]) - (top + high) * ky];
    for (const l of lines) l.path.setAttribute('transform', `translate(${to}) scale(${kx / 10} ${ky / 10})`);
    axes.replaceChildren();
    const at = (log ? decades : ticks)(view.x), names = at.map(v => tick(plain(v, 3)));
    const all = Math.max(...names.map(n => n.length)) * at.length < wide / 9; // else every second name
    for (const [k, v] of at.entries()) if (all || k % 2 === 0) {
      drawn('path', {class: 'grid', d: `M${px(v)} ${top}V${top + high}`}, axes);
      const below = {class: 'tick', x: px(v), y: top + high + 15, 'text-anchor': 'middle'};
      drawn('text', below, axes).textContent = names[k];
    }
    for (const v of ticks(view.y)) {
      drawn('path', {class: 'grid', d: `M${left} ${py(v)}H${left + wide}`}, axes);
      drawn('text', {class: 'tick', x: left - 5, y: py(v) + 4, 'text-anchor': 'end'}, axes).textContent = tick(v);
    }
    hide();
  }
  function hide() {
    for (const e of [rule, box, ...lines.map(l => l.mark)]) e.setAttribute('visibility', 'hidden');
    output.textContent = '';
  }
  function mark(l, k) {
    const [x, y] = l.points[k];
    l.mark.setAttribute('cx', px(x)), l.mark.setAttribute('cy', py(y)), l.mark.setAttribute('visibility', 'visible');
    return y;
  }
  const nearest = (points, far) => points.reduce((best, p, k) => far(p) < far(points[best]) ? k : best, 0);
  // the values of all curves at x
  function show(x) {
    hide();
    if (x < view.x[0] || x > view.x[1]) return;
    rule.setAttribute('d', `M${px(x)} ${top}V${top + high}`), rule.setAttribute('visibility', 'visible');
    const values = lines.map(l => `${l.name} ${print(mark(l, nearest(l.points, p => Math.abs(p[0] - x))))}`);
    output.textContent = `${svg.dataset.label} ${print(plain(x, 5))}: ${values.join(', ')}`;
  }
  // the point of a loop that is nearest on the screen
  function point(l, k) {
    hide();
    output.textContent = `${l.name}: ${print(plain(l.points[k][0], 5))}, ${print(mark(l, k))}`;
  }
  function hover([x, y]) {
    if (functions) {
      for (const c of cursors) if (c.label === svg.dataset.label && c.functions) c.show(vx(x));
      return;
    }
    const far = p => Math.hypot(px(p[0]) - x, py(p[1]) - y);
    const each = lines.map(l => [l, nearest(l.points, far)]);
    point(...each.reduce((a, b) => far(b[0].points[b[1]]) < far(a[0].points[a[1]]) ? b : a));
  }
  function zoom([x, y], factor) {
    const about = (ends, v) => ends.map(e => v + (e - v) * factor);
    view = {x: about(view.x, vx(x)), y: about(view.y, vy(y))};
    if (view.x[1] - view.x[0] >= whole.x[1] - whole.x[0]) view = {...whole};
    draw();
  }
  function reset() {
    view = {...whole};
    draw();
  }

  const place = e => {
    const p = new DOMPoint(e.clientX, e.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [Math.min(left + wide, Math.max(left, p.x)), Math.min(top + high, Math.max(top, p.y))];
  };
  let from = null;
  svg.addEventListener('pointerdown', e => {
    svg.focus({preventScroll: true});
    if (e.pointerType !== 'touch') from = place(e), svg.setPointerCapture(e.pointerId);
  });
  svg.addEventListener('pointermove', e => {
    const at = place(e);
    if (!from) return hover(at);
    const [x, y] = from.map((v, k) => Math.min(v, at[k]));
    const size = {x, y, width: Math.abs(at[0] - from[0]), height: Math.abs(at[1] - from[1]), visibility: 'visible'};
    for (const k in size) box.setAttribute(k, size[k]);
  });
  svg.addEventListener('pointerup', e => {
    const begin = from, end = place(e);
    from = null;
    if (begin && Math.abs(begin[0] - end[0]) > 8 && Math.abs(begin[1] - end[1]) > 8) {
      const order = (a, b) => [Math.min(a, b), Math.max(a, b)];
      view = {x: order(vx(begin[0]), vx(end[0])), y: order(vy(begin[1]), vy(end[1]))};
      draw();
    } else hover(end);
  });
  svg.addEventListener('pointercancel', () => from = null);
  svg.addEventListener('pointerleave', () => cursors.forEach(c => c.hide()));
  svg.addEventListener('dblclick', reset);
  svg.addEventListener('wheel', e => { // a page scrolls on, unless the reader has chosen the plot
    if (document.activeElement !== svg && !e.ctrlKey) return;
    e.preventDefault();
    zoom(place(e), e.deltaY < 0 ? 0.8 : 1.25);
  }, {passive: false});
  let at = 0;
  svg.addEventListener('keydown', e => {
    const points = lines[0].points, many = Math.max(1, Math.round(points.length / 100));
    const move = {ArrowRight: many, ArrowLeft: -many}[e.key], factor = {'+': 0.8, '-': 1.25}[e.key];
    if (move) {
      at = Math.min(points.length - 1, Math.max(0, at + move));
      functions ? hover([px(points[at][0]), 0]) : point(lines[0], at);
    } else if (factor) zoom([left + wide / 2, top + high / 2], factor);
    else if (e.key === '0' || e.key === 'Escape') reset();
    else return;
    e.preventDefault();
  });
  svg.setAttribute('tabindex', 0);
  svg.ariaLabel += '. Arrow keys move a cursor, + and - zoom, 0 resets.';
  cursors.push({label: svg.dataset.label, functions, show, hide});
}

document.querySelectorAll('figure svg[data-x]').forEach(plot);
const reveal = () => { // a link leads into a folded part
  const fold = document.getElementById(decodeURIComponent(location.hash.slice(1)))?.closest('details');
  if (fold) fold.open = true, fold.scrollIntoView();
};
addEventListener('hashchange', reveal);
reveal();
addEventListener('beforeprint', () => document.querySelectorAll('details').forEach(d => d.open = true));
