// explorer.js - the reader moves the input of models with pointer, keys or a signal; the C core computes every value.
const ROOM = 20000; // rows of a path that are kept at least
const SIGNALS = { // in [0, 1] over periods; null: over
  'sine': k => 0.5 - 0.5 * Math.cos(2 * Math.PI * k),
  'decaying sine': k => k < 10 ? 0.5 - 0.5 * Math.cos(2 * Math.PI * k) * (1 - k / 10) : null,
  'random reversals': k => { // half a cosine from one level to the next, the same in every run
    const level = i => i ? (Math.imul(i, 2654435761) >>> 8) / 2 ** 24 : 0, i = Math.floor(2 * k);
    return level(i) + (level(i + 1) - level(i)) * (0.5 - 0.5 * Math.cos(Math.PI * (2 * k - i)));
  },
};

async function explorer(place) {
  const data = JSON.parse(place.querySelector('script').textContent), core = await load(data.core);
  const models = data.models.map((m, k) => ({...m, colour: k % 5, shown: k < 3, seen: [], y: [],
    plant: graph(core, m.graph), before: m.inverse && graph(core, m.inverse)}));
  const {h} = models[0], [uLabel, yLabel] = data.labels, measured = data.measured.length ? data.measured : [[], []];
  const lo = Math.min(...models.map(m => m.lo)), hi = Math.max(...models.map(m => m.hi));
  const still = matchMedia('(prefers-reduced-motion: reduce)');

  // the second rise and fall of the input, without the way from rest: the range of the outputs, and the input of the
  // memory over that of the model
  const wanted = [Infinity, -Infinity];
  for (const m of models) {
    m.plant.rest();
    if (turning(m)) m.origin = current(turning(m));
    m.swept = [];
    for (let k = -400; k <= 400; k++) {
      const u = lo + (hi - lo) * (1 - Math.abs(Math.abs(k) - 200) / 200), y = m.plant.next(u, h);
      if (k < 0) continue;
      wanted[0] = Math.min(wanted[0], y), wanted[1] = Math.max(wanted[1], y);
      if (turning(m)) m.swept.push([u, current(turning(m))]);
      if (!data.measured.length && m === models[0]) measured[0].push(u), measured[1].push(y);
    }
  }
  const outputs = [least(measured[1], wanted[0]), most(measured[1], wanted[1])];

  // ---- the path: what the reader moves (w), the input of the models (u), and their outputs
  let w = [], u = [], front = null, problem = '', moved = false, demo = false;
  const ends = () => front ? wanted : [lo, hi];
  const within = v => Math.min(ends()[1], Math.max(ends()[0], v));
  const last = () => w[w.length - 1];
  function feed(value) {
    const input = front ? front.before.next(value, h) : value;
    w.push(value), u.push(input);
    for (const m of models) m.y.push(m.plant.next(input, h)), m.seen.push(turning(m) ? current(turning(m)) : 0);
    if (w.length > 2 * ROOM) for (const list of [w, u, ...models.flatMap(m => [m.y, m.seen])]) list.splice(0, ROOM);
  }
  function run(path) { // from a fresh start
    w = [], u = [];
    for (const m of models) m.y = [], m.seen = [], m.plant.restart(), m.before && m.before.restart();
    guarded(() => path.forEach(feed));
  }
  function guarded(work) {
    problem = '';
    try {
      work();
    } catch (e) {
      problem = e.message;
      pause();
    }
    later();
  }
  function restart() {
    pause();
    demo = false;
    run([within(0)]);
  }
  function demonstrate() { // what a reader sees first; the first move of his own begins anew
    restart();
    const [a, b] = ends(), n = period(), signal = SIGNALS['decaying sine'];
    go(a);
    guarded(() => {
      for (let k = 1; k <= 3 * n; k++) feed(a + (b - a) * signal(k / n));
    });
    demo = true;
  }
  function fresh() {
    if (demo) restart();
  }
  function go(to) { // at the mean speed of a sine of the chosen frequency
    fresh();
    const from = last(), share = Math.abs(to - from) / (ends()[1] - ends()[0]);
    const steps = Math.max(1, Math.ceil(share * period() / 2));
    guarded(() => {
      for (let k = 1; k <= steps; k++) feed(k === steps ? to : from + (to - from) * k / steps);
    });
  }
  function save() {
    const head = ['t', ...(front ? ['wanted'] : []), 'u', ...models.map(m => m.name)];
    const rows = w.map((v, k) => [k * h, ...(front ? [v] : []), u[k], ...models.map(m => m.y[k])]);
    const href = URL.createObjectURL(new Blob([[head, ...rows, ''].join('\n')]));
    element('a', {download: 'path.csv', href}).click();
    URL.revokeObjectURL(href);
  }

  // ---- playing
  let playing = null;
  function play() {
    fresh();
    const signal = SIGNALS[chosen.value], mine = playing = {};
    let k = 0;
    function some(steps) {
      for (; steps > 0; steps--, k++) {
        const share = signal(k / period()), to = ends()[0] + (ends()[1] - ends()[0]) * share;
        if (share === null) return false;
        if (k) feed(to); else go(to);
      }
      return !still.matches;
    }
    function frame() {
      if (playing !== mine) return;
      let more = false;
      guarded(() => more = some(Math.ceil(still.matches ? 10 * period() : period() / 120)));
      if (more) requestAnimationFrame(frame); else pause();
    }
    player.textContent = 'Pause';
    frame();
  }
  function pause() {
    playing = null;
    player.textContent = 'Play';
  }

  // ---- controls
  const row = (...parts) => element('div', {class: 'controls'}, ...parts);
  const label = (text, ...parts) => element('label', {}, text, ...parts);
  function control(e, event, act) {
    e.addEventListener(event, () => act(e));
    return e;
  }
  const button = (text, act) => control(element('button', {type: 'button'}, text), 'click', act);
  const slider = (min, max, value, act) =>
    control(element('input', {type: 'range', min, max, step: 'any', value}), 'input', act);
  const select = (options, act) => // [text, value] each; act takes the value
    control(element('select', {}, ...options.map(([text]) => element('option', {}, text))), 'change',
      e => act(options[e.selectedIndex][1]));
  const player = button('Play', () => playing ? pause() : play());
  const chosen = select(Object.entries(SIGNALS), () => {});
  chosen.value = 'decaying sine';
  const hertz = element('output'), period = () => 10 ** -speed.value; // in steps
  const tell = () => hertz.textContent = `${print(1 / (period() * h))} Hz`;
  const speed = slider(-4, -1.3, -Math.log10(400), tell);
  const controls = row(player, label('signal ', chosen), label('speed ', speed, hertz));
  const inverses = models.filter(m => m.before).map(m => [`inverse of ${m.name}`, m]);
  if (inverses.length) controls.append(label('in front ', select([['no inverse', null], ...inverses], m => {
    front = m;
    demonstrate();
  })));
  controls.append(button('Restart', restart), button('Save the path', save));

  const several = models.length > 1, legend = element('fieldset', {class: 'controls'}, element('legend', {}, 'models'));
  for (const m of models) {
    const box = control(element('input', {type: 'checkbox'}), 'change', () => (m.shown = box.checked, later()));
    box.checked = m.shown;
    legend.append(element('label', {class: `c${m.colour}`}, box, m.name));
  }
  const shown = () => models.filter(m => m.shown);

  // parameters from 0 to twice their values, covariates over their range
  const tuning = row(), amount = element('output');
  const called = (m, s) => several ? `${m.name}: ${s.name}` : s.name;
  const movable = models.flatMap(m => m.sliders.map(s =>
    [called(m, s), {...s, model: m, values: m.plant.values(s.reference, s.size)}]));
  if (movable.length) {
    let of = movable[0][1];
    const share = slider(0, 2, 1, () => {
      const x = +share.value, values = of.values.map(v => of.lo === null ? v * x : of.lo + (of.hi - of.lo) * x / 2);
      amount.textContent = values.length > 1 ? `${print(100 * x)} % of ${values.length} values` : print(values[0]);
      moved = true;
      guarded(() => values.forEach((v, k) => of.model.plant.set(of.reference + k, v)));
      if (!problem) run(w);
    });
    tuning.append(label('parameter ', select(movable, s => {
      of = s;
      share.value = of.lo === null ? 1 : 2 * (of.values[0] - of.lo) / (of.hi - of.lo);
      amount.textContent = '';
    })), label('amount ', share, amount), button('Values of the model', () => {
      for (const m of models) m.plant.defaults();
      share.value = 1, amount.textContent = '', moved = false;
      run(w);
    }));
  }

  // ---- pictures
  const canvas = (name, attributes) => element('canvas', {class: name, ...attributes});
  const loop = canvas('loop', {tabindex: 0, role: 'slider'});
  const plane = canvas('plane', {role: 'img'}), time = canvas('time', {role: 'img'});
  const status = element('p', {class: 'status', role: 'status'}), about = element('p', {class: 'about'});
  let viewed = models[0], map = null;
  const memory = row(label('memory of ', select(models.map(m => [m.name, m]), m => (viewed = m, later()))));
  const help = 'Drag in the plot, or focus it and use the arrow keys; space plays the signal.';
  const side = element('div', {}, ...(several ? [memory] : []), plane, about);
  place.append(element('p', {class: 'lead'}, help), ...(several ? [legend] : []), controls, tuning,
    element('div', {class: 'panels'}, loop, side, time), status);

  const abscissa = () => front ? w : u;
  function drawLoop() {
    const x = abscissa(), ys = shown().reduce((r, m) => [least(m.y, r[0]), most(m.y, r[1])], outputs);
    map = axes(loop, pad(ends()), pad(ys), front ? `wanted: ${yLabel}` : uLabel, yLabel);
    if (front) map.curve(k => wanted[k], wanted, 'soft', 0, 1);
    else map.curve(k => measured[0][k], measured[1], 'soft', 0, 1);
    for (const m of shown()) {
      map.curve(k => x[k], m.y, `c${m.colour}`);
      map.dot(x[x.length - 1], m.y[x.length - 1], `c${m.colour}`, 5);
    }
    if (!viewed.shown || !turning(viewed)) return;
    map.g.strokeStyle = map.colour('fg'), map.g.lineWidth = 1.5;
    for (const v of points(turning(viewed))) { // where the path was when the block took it
      const k = viewed.seen.lastIndexOf(v);
      if (k >= 0) map.g.strokeRect(map.X(x[k]) - 4, map.Y(viewed.y[k]) - 4, 8, 8);
    }
  }
  function drawTime() {
    const first = Math.max(0, w.length - Math.max(400, Math.ceil(4 * period()))), t = k => k * h;
    const span = [t(first), t(Math.max(w.length - 1, first + 10))];
    const above = axes(time, span, pad(outputs), '', yLabel, [0, 0.5]);
    if (front) above.curve(t, w, 'soft', first, 1);
    for (const m of shown()) above.curve(t, m.y, `c${m.colour}`, first);
    axes(time, span, pad([least(u, lo), most(u, hi)]), 't (s)', uLabel, [0.5, 1]).curve(t, u, 'fg', first, 1.5);
    time.ariaLabel = `outputs and input over time, ${print(span[0])} to ${print(span[1])} s`;
  }
  function say() {
    const values = shown().map(m => `${m.name} ${print(m.y[m.y.length - 1])}`).join(', ');
    const input = `${uLabel} ${print(u[u.length - 1])}, ${yLabel}: ${values}`;
    loop.ariaLabel = front ? `wanted output: ${yLabel}` : `input of the models: ${uLabel}`;
    [loop.ariaValueMin, loop.ariaValueMax] = ends();
    loop.ariaValueNow = print(last());
    loop.ariaValueText = front ? `wanted ${print(last())}, ${input}` : input;
    status.classList.toggle('bad', !!problem);
    status.textContent = problem || loop.ariaValueText + (moved ? '. Parameters were moved.' : '');
  }
  let due = 0;
  function draw() {
    due = 0;
    drawLoop(), drawTime();
    const text = drawMemory(plane, viewed, uLabel);
    if (text !== about.textContent) about.textContent = plane.ariaLabel = text;
    if (w.length) say();
  }
  const later = () => due = due || requestAnimationFrame(draw);

  // ---- pointer and keys
  const under = e => within(map.vx(e.clientX - loop.getBoundingClientRect().left));
  loop.addEventListener('pointerdown', e => {
    loop.setPointerCapture(e.pointerId);
    loop.focus({preventScroll: true});
    pause();
    go(under(e));
  });
  loop.addEventListener('pointermove', e => {
    if (loop.hasPointerCapture(e.pointerId)) return go(under(e));
    const x = abscissa(), {left, top} = loop.getBoundingClientRect();
    let best = 20, text = ''; // points on the screen
    for (const m of shown()) for (let k = 0; k < x.length; k++) {
      const far = Math.hypot(map.X(x[k]) - e.clientX + left, map.Y(m.y[k]) - e.clientY + top);
      if (far >= best) continue;
      best = far;
      text = `${m.name}: ${front ? 'wanted' : uLabel} ${print(x[k])}, ${yLabel} ${print(m.y[k])} at ${print(k * h)} s`;
    }
    if (text) status.textContent = text;
  });
  loop.addEventListener('pointerleave', later);
  loop.addEventListener('keydown', e => {
    const part = {ArrowRight: 0.01, ArrowUp: 0.01, ArrowLeft: -0.01, ArrowDown: -0.01, PageUp: 0.1, PageDown: -0.1,
      Home: -2, End: 2}[e.key];
    if (part) pause(), fresh(), go(within(last() + part * (ends()[1] - ends()[0])));
    else if (e.key === ' ') player.click();
    else return;
    e.preventDefault();
  });
  new ResizeObserver(later).observe(place);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', later);
  matchMedia('print').addEventListener('change', draw); // at once, in the colours of paper
  tell();
  demonstrate();
}

document.querySelectorAll('.explorer').forEach(place => explorer(place).catch(e => {
  place.append(element('p', {class: 'bad', role: 'alert'}, `The explorer cannot start: ${e.message}`));
}));
