// What a page gets wrong for readers with a keyboard, a screen reader or weak eyes: a list of sentences.
() => {
  const wrong = [];
  const seen = e => e.checkVisibility({visibilityProperty: true}) && !e.closest('[aria-hidden=true]');
  const say = (e, text) => wrong.push(`${e.tagName.toLowerCase()}.${e.getAttribute('class') || ''} "${(e.textContent || '').trim().slice(0, 30)}": ${text}`);

  // contrast of texts, WCAG 2.1: 4.5, of large texts 3
  const channel = v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const numbers = c => c.match(/[\d.]+/g).map(Number);
  const light = c => numbers(c).slice(0, 3).map(channel).reduce((s, v, k) => s + v * [0.2126, 0.7152, 0.0722][k], 0);
  const clear = c => c === 'transparent' || (c.startsWith('rgba') && numbers(c)[3] === 0);
  const ratio = (a, b) => (Math.max(light(a), light(b)) + 0.05) / (Math.min(light(a), light(b)) + 0.05);
  const behind = e => {
    for (; e; e = e.parentElement) {
      const c = getComputedStyle(e).backgroundColor;
      if (!clear(c)) return c;
    }
    return 'rgb(255, 255, 255)';
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let n = texts.nextNode(); n; n = texts.nextNode()) {
    const e = n.parentElement;
    if (!n.data.trim() || ['SCRIPT', 'STYLE', 'NOSCRIPT', 'OPTION'].includes(e.tagName) || !seen(e)) continue;
    const s = getComputedStyle(e), colour = e.namespaceURI.endsWith('svg') ? s.fill : s.color;
    const large = parseFloat(s.fontSize) >= 24 || (parseFloat(s.fontSize) >= 18.66 && s.fontWeight >= 600);
    const found = ratio(colour, behind(e));
    if (found < (large ? 3 : 4.5)) say(e, `contrast ${found.toFixed(2)}`);
  }
  // curves and borders of controls: 3
  for (const e of document.querySelectorAll('path.line:not(.shade), button:not(.sort), select, input')) if (seen(e)) {
    const s = getComputedStyle(e), colour = e.tagName === 'path' ? s.stroke : s.borderTopColor;
    if (ratio(colour, behind(e.parentElement)) < 3) say(e, `contrast ${ratio(colour, behind(e.parentElement)).toFixed(2)}`);
  }
  const probe = document.querySelector('.explorer');
  if (probe) for (const k of [0, 1, 2, 3, 4]) { // curves of the canvas
    const e = probe.appendChild(document.createElement('i'));
    e.style.color = `var(--c${k})`;
    if (ratio(getComputedStyle(e).color, behind(probe)) < 3) say(e, `contrast of curve ${k}`);
    e.remove();
  }
  // names of controls and pictures
  const name = e => e.getAttribute('aria-label') || (e.labels && [...e.labels].map(l => l.textContent).join(' ')) || e.textContent;
  for (const e of document.querySelectorAll('button, select, input, a[href], summary, [role=slider], [role=img], svg, canvas'))
    if (seen(e) && !(name(e) || '').trim()) say(e, 'no name');
  for (const e of document.querySelectorAll('svg, canvas')) if (seen(e) && !e.getAttribute('role')) say(e, 'no role');
  for (const e of document.querySelectorAll('img:not([alt])')) say(e, 'no alternative text');
  // texts of a picture lie inside it, and not on one another
  for (const svg of document.querySelectorAll('svg')) {
    if (svg.parentElement && svg.parentElement.closest('svg')) continue;
    const texts = [...svg.querySelectorAll('text')].filter(seen).map(e => [e, e.getBoundingClientRect()]);
    const whole = svg.getBoundingClientRect();
    texts.forEach(([e, a], k) => {
      const out = Math.max(whole.left - a.left, a.right - whole.right, whole.top - a.top, a.bottom - whole.bottom);
      if (out > 1) say(e, `${out.toFixed(1)} points outside of its picture`);
      texts.slice(k + 1).forEach(([other, b]) => {
        const over = ['left', 'top'].map((low, i) => Math.min(a[['right', 'bottom'][i]], b[['right', 'bottom'][i]]) - Math.max(a[low], b[low]));
        if (over[0] > 0 && over[1] > 2) say(e, `lies on "${other.textContent}"`);
      });
    });
  }
  // what the keyboard reaches: in the order of the document, nothing hidden
  for (const e of document.querySelectorAll('[tabindex]')) if (e.tabIndex > 0) say(e, 'its own place in the order of focus');
  for (const e of document.querySelectorAll('[onclick], .sort, summary, canvas.loop')) if (e.tabIndex < 0) say(e, 'not reached by the keyboard');
  // headings: one h1, no level left out
  const levels = [...document.querySelectorAll('h1, h2, h3, h4')].map(e => +e.tagName[1]);
  if (levels[0] !== 1 || levels.filter(v => v === 1).length !== 1) wrong.push(`headings: ${levels}`);
  levels.forEach((v, k) => k && v > levels[k - 1] + 1 && wrong.push(`headings: ${levels}`));
  // tables, language, title, identities, width
  for (const e of document.querySelectorAll('th')) if (!e.scope || !e.textContent.trim()) say(e, 'a heading without scope or text');
  if (!document.documentElement.lang || !document.title || !document.querySelector('main, [role=main]')) wrong.push('no lang, title or main');
  const ids = [...document.querySelectorAll('[id]')].map(e => e.id);
  if (new Set(ids).size !== ids.length) wrong.push(`equal ids: ${ids}`);
  if (document.documentElement.scrollWidth > innerWidth) wrong.push(`${document.documentElement.scrollWidth} px wide in ${innerWidth}`);
  return wrong;
}
