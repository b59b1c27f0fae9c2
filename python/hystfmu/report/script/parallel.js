// parallel.js - a reader chooses ranges on the axes of parallel coordinates; the draws outside them fade.
function parallel(svg) {
  const output = svg.parentNode.querySelector('figcaption').appendChild(element('output'));
  const draws = [...svg.querySelectorAll('.draw')].map(path => {
    const d = path.getAttribute('d').match(/-?\d+/g).map(Number), xs = [];
    for (let k = 0, x = 0; k < d.length; k += 2) xs.push((x += d[k]) / 10);
    return {path, xs, good: path.classList.contains('c0')};
  });
  const ranges = [];
  const far = draws.length ? draws[0].xs.length : 0;
  function show() {
    const chosen = ranges.some(r => r);
    const kept = draws.filter(d => {
      const inside = ranges.every((r, k) => !r || (d.xs[k] >= r[0] && d.xs[k] <= r[1]));
      d.path.classList.toggle('off', !inside);
      return inside;
    });
    const good = kept.filter(d => d.good).length, share = kept.length ? ` (${print(100 * good / kept.length)} %)` : '';
    const what = `${good} of ${kept.length} variations${share}`;
    output.textContent = chosen ? `In the chosen ranges ${what}: ${svg.dataset.good}.` : '';
  }
  [...svg.querySelectorAll('.axis')].slice(0, far).forEach((axis, k) => {
    const line = axis.querySelector('.frame').getBBox(), {name} = axis.dataset;
    const ends = axis.dataset.ends.split(' ').map(Number);
    const value = x => print(ends[0] + (ends[1] - ends[0]) * (x - line.x) / line.width);
    const size = {x: line.x, y: line.y - 12, width: line.width, height: 24};
    const bar = drawn('rect', {class: 'box', visibility: 'hidden', ...size}, axis);
    const field = drawn('rect', {class: 'field', ...size}, axis);
    const told = {tabindex: 0, role: 'slider', 'aria-label': `${name}. Arrow keys choose a third, Escape all.`,
      'aria-valuemin': ends[0], 'aria-valuemax': ends[1]};
    for (const a in told) field.setAttribute(a, told[a]);
    function choose(range) {
      ranges[k] = range;
      bar.setAttribute('visibility', range ? 'visible' : 'hidden');
      if (range) bar.setAttribute('x', range[0]), bar.setAttribute('width', range[1] - range[0]);
      const [a, b] = (range || [line.x, line.x + line.width]).map(value);
      field.setAttribute('aria-valuenow', (+a + +b) / 2), field.setAttribute('aria-valuetext', `${a} to ${b}`);
      show();
    }
    const place = e => {
      const {x} = new DOMPoint(e.clientX, e.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return Math.min(line.x + line.width, Math.max(line.x, x));
    };
    let from = null, third = 0;
    field.addEventListener('pointerdown', e => {
      from = place(e);
      field.setPointerCapture(e.pointerId);
      choose(null);
    });
    field.addEventListener('pointermove', e => {
      if (from !== null && Math.abs(place(e) - from) > 4) choose([from, place(e)].sort((a, b) => a - b));
    });
    field.addEventListener('pointerup', () => from = null);
    field.addEventListener('pointercancel', () => from = null);
    field.addEventListener('keydown', e => {
      const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: 3, ArrowDown: 3}[e.key];
      if (step) third = (third + step) % 4;
      else if (e.key === 'Escape' || e.key === '0') third = 0;
      else return;
      choose(third ? [third - 1, third].map(v => line.x + line.width * v / 3) : null);
      e.preventDefault();
    });
    choose(null);
  });
}

document.querySelectorAll('svg.parallel').forEach(parallel);
