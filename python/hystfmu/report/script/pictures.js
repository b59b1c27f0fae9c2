// pictures.js - what the explorer draws: axes with curves, and the memory of a block.
const least = (list, v) => list.reduce((a, b) => Math.min(a, b), v);
const most = (list, v) => list.reduce((a, b) => Math.max(a, b), v);
const pad = ([a, b]) => [a - 0.05 * (b - a || 1), b + 0.05 * (b - a || 1)];

// a frame with axes on a part of a canvas, from top to bottom; the first part clears the canvas
function axes(canvas, xs, ys, xLabel, yLabel, [first, end] = [0, 1]) {
  const sharp = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  const g = canvas.getContext('2d'), style = getComputedStyle(canvas);
  const colour = name => style.getPropertyValue(`--${name}`).trim();
  if (first === 0) canvas.width = width * sharp, canvas.height = height * sharp, g.scale(sharp, sharp);
  const left = 52, right = width - 18, top = first * height + 22, bottom = end * height - (xLabel ? 36 : 22);
  const kx = (right - left) / (xs[1] - xs[0]), ky = (bottom - top) / (ys[1] - ys[0]);
  const X = v => left + (v - xs[0]) * kx, Y = v => bottom - (v - ys[0]) * ky;
  function line(...points) {
    g.beginPath();
    for (const p of points) g.lineTo(...p);
    g.stroke();
  }
  function curve(x, y, name, from = 0, wide = 2) {
    g.strokeStyle = colour(name), g.lineWidth = wide, g.lineJoin = 'round';
    g.beginPath();
    for (let k = from; k < y.length; k++) g.lineTo(X(x(k)), Y(y[k]));
    g.stroke();
  }
  function dot(x, y, name, r) {
    g.fillStyle = colour(name);
    g.beginPath(), g.arc(X(x), Y(y), r, 0, 7), g.fill();
  }
  function write(text, x, y, align) {
    g.textAlign = align;
    g.fillText(text, x, y);
  }
  g.font = '12px system-ui, sans-serif', g.lineWidth = 1, g.fillStyle = colour('soft'), g.strokeStyle = colour('line');
  for (const v of ticks(xs, (right - left) / 80)) {
    line([X(v), top], [X(v), bottom]);
    write(tick(v), X(v), bottom + 15, 'center');
  }
  for (const v of ticks(ys, (bottom - top) / 35)) {
    line([left, Y(v)], [right, Y(v)]);
    write(tick(v), left - 5, Y(v) + 4, 'right');
  }
  g.strokeStyle = colour('soft');
  g.strokeRect(left, top, right - left, bottom - top);
  write(xLabel, right, bottom + 29, 'right');
  write(yLabel, 4, top - 8, 'left');
  return {g, X, Y, colour, line, curve, dot, vx: p => xs[0] + (p - left) / kx};
}

// the list of turning points of a model, as turning_points.h lays it out: count, direction, x, h, points
const turning = ({memory, plant}) =>
  memory && memory.kind === 'turns' ? plant.state(memory.node).subarray(memory.place) : null;
const current = list => list[2];
const points = list => [...list.subarray(4, 4 + list[0])];

// Each picture of a memory returns its description.  Relays (beta, alpha) of the Preisach plane: up when the input has
// risen to alpha, down when it has fallen to beta; before, up below the line through the origin of the first branch.
function drawPlane(canvas, m, label) {
  const list = turning(m), xs = [...points(list), current(list)], n = 72, {block} = m.memory;
  const seen = m.swept.map(p => p[1]), a = least(seen, m.origin), b = most(seen, m.origin), cell = (b - a) / n;
  const [u0, x0] = m.swept[0], [u1, x1] = m.swept[200], slope = (u1 - u0) / (x1 - x0);
  const affine = slope > 0 && m.swept.every(([u, x]) => Math.abs(u - u0 - (x - x0) * slope) < 1e-6 * Math.abs(u1 - u0));
  const unit = x => affine ? u0 + (x - x0) * slope : x, range = [unit(a), unit(b)];
  const name = affine ? label : `input of ${block}`;
  const {g, X, Y, colour, line} = axes(canvas, range, range, `beta: ${name}`, `alpha: ${name}`);
  const at = k => unit(a + k * cell);
  for (let i = 0; i < n; i++) for (let j = i; j < n; j++) {
    const beta = a + (i + 0.5) * cell, alpha = a + (j + 0.5) * cell;
    let up = alpha + beta < 2 * m.origin;
    for (const x of xs) up = x >= alpha || (x > beta && up);
    g.fillStyle = colour(up ? `c${m.colour}` : 'line');
    g.fillRect(X(at(i)), Y(at(j + 1)), X(at(i + 1)) - X(at(i)) + 0.5, Y(at(j)) - Y(at(j + 1)) + 0.5);
  }
  const now = unit(current(list));
  g.strokeStyle = colour('fg'), g.lineWidth = 1.5;
  line([X(range[0]), Y(now)], [X(now), Y(now)], [X(now), Y(range[1])]);
  return `Preisach plane of the block ${block}: filled relays are switched up. It holds ${list[0]} turning points, ` +
    'the squares on the loop.';
}

function drawPlays(canvas, m) {
  const {widths, size, node, place, block} = m.memory, values = m.plant.values(widths, size);
  const z = [...m.plant.state(node).subarray(place, place + size)];
  const r = most(values, 0), ys = pad([least(z, -r), most(z, r)]);
  const {curve, dot} = axes(canvas, pad([0, r]), ys, 'half-width r', 'state z of the play');
  curve(k => values[k], z, `c${m.colour}`, 0, 1.5);
  values.forEach((v, k) => dot(v, z[k], `c${m.colour}`, 3));
  return `States of the ${z.length} plays of the block ${block} over their half-widths.`;
}

function drawMemory(canvas, m, label) {
  if (turning(m)) return drawPlane(canvas, m, label);
  if (m.memory && m.memory.kind === 'plays') return drawPlays(canvas, m);
  canvas.width = canvas.width; // clears it
  if (!m.memory) return `${m.name} has no memory to show.`;
  const {names, node, place, block} = m.memory, state = m.plant.state(node);
  return `States of the block ${block}. ${names.map((n, k) => `${n}: ${print(state[place + k])}`).join('; ')}.`;
}
