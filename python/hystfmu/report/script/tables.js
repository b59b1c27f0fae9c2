// tables.js - sorting by the heading of a column, filtering of rows.
const FEW = 8; // rows that need no filter

function table(t) {
  const [first, ...rows] = t.rows, heads = [...first.cells];
  if (rows.length < 3 || t.querySelector('[rowspan], [colspan]')) return;
  const cell = (row, k) => row.cells[k].textContent.trim();
  heads.forEach((head, k) => {
    const button = element('button', {type: 'button', class: 'sort'}, ...head.childNodes);
    head.append(button);
    button.addEventListener('click', () => {
      const down = head.getAttribute('aria-sort') === 'ascending';
      heads.forEach(h => h.removeAttribute('aria-sort'));
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      const number = text => parseFloat(text.replace('< ', ''));
      const texts = rows.map(r => cell(r, k)), found = texts.filter(v => !isNaN(number(v))).length;
      const numbers = 2 * found > texts.filter(v => v && v !== '-').length; // the others are words: stopped, unstable
      const value = r => numbers ? number(cell(r, k)) : cell(r, k);
      const order = (a, b) => numbers ? (isNaN(a) ? 1 : isNaN(b) ? -1 : a - b) : a.localeCompare(b);
      rows.sort((a, b) => (down ? -1 : 1) * order(value(a), value(b)));
      rows[0].parentNode.append(...rows);
    });
  });
  if (rows.length <= FEW) return;
  const input = element('input', {type: 'search'}), count = element('output');
  input.addEventListener('input', () => {
    const wanted = input.value.toLowerCase(), kept = rows.filter(r => r.textContent.toLowerCase().includes(wanted));
    rows.forEach(r => r.hidden = !kept.includes(r));
    count.textContent = wanted ? `${kept.length} of ${rows.length} rows` : '';
  });
  t.parentNode.before(element('p', {class: 'filter'}, element('label', {}, 'Filter rows ', input), ' ', count));
}

document.querySelectorAll('table').forEach(table);
