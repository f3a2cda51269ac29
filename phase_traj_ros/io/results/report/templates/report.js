// Copyright 2026 phase_traj_ros contributors
// SPDX-License-Identifier: Apache-2.0
'use strict';
(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const byId = (id) => document.getElementById(id);
  const pairs = data.seconds.length;
  const end = data.seconds[pairs - 1];
  const MARGIN = { left: 72, right: 14 };
  const RIBBON = 16;

  const plots = [
    { title: 'shift (px per frame)', values: data.dx, height: 150,
      lines: data.threshold === null ? [] : [data.threshold, -data.threshold] },
    { title: 'response', values: data.response, height: 90, from: 0,
      lines: [data.low_response] },
  ];
  if (data.heading) plots.push({ title: 'heading (°)', values: data.heading, height: 110 });
  if (data.speed) {
    plots.push({ title: `speed (${data.speed_unit})`, values: data.speed, height: 90 });
  }
  const ribbons = [
    { title: 'movement', codes: data.movement,
      colours: data.movement_colours },
    { title: 'direction', codes: data.direction,
      colours: data.direction_colours },
  ];

  let shown = [0, end];
  let selected = 0;
  let dragFrom = null;
  let dragTo = null;
  // The style follows the palette of the page.
  const style = getComputedStyle(document.documentElement);
  const colours = new Proxy({}, { get: (_, name) => style.getPropertyValue(name).trim() });

  // A canvas as large as its box, in device pixels, drawn on in CSS pixels.
  function prepare(canvas, height) {
    const width = canvas.clientWidth;
    const ratio = window.devicePixelRatio || 1;
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = '11px system-ui, sans-serif';
    return { pen, width, height };
  }

  function totalHeight() {
    return plots.reduce((sum, plot) => sum + plot.height + 26, 0)
      + ribbons.length * (RIBBON + 8) + 26;
  }

  const xOf = (seconds, width) => MARGIN.left
    + (seconds - shown[0]) / (shown[1] - shown[0]) * (width - MARGIN.left - MARGIN.right);
  const secondsAt = (x, width) => shown[0]
    + (x - MARGIN.left) / (width - MARGIN.left - MARGIN.right) * (shown[1] - shown[0]);

  // The pair whose second frame is nearest to a time.
  function pairAt(seconds) {
    let low = 0;
    let high = pairs - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (data.seconds[middle] < seconds) low = middle + 1; else high = middle;
    }
    if (low > 0 && seconds - data.seconds[low - 1] < data.seconds[low] - seconds) low -= 1;
    return low;
  }

  const startOf = (pair) => (pair === 0 ? 0 : data.seconds[pair - 1]);

  function niceStep(span, count) {
    const rough = span / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].find((each) => each * power >= rough);
    return step * power;
  }

  function ticks(from, to, count) {
    const step = niceStep(to - from, count);
    const found = [];
    for (let index = Math.ceil(from / step - 1e-9); index * step <= to + step * 1e-9; index += 1) {
      found.push(Number((index * step).toPrecision(12)));
    }
    return found;
  }

  function rangeOf(plot) {
    let low = plot.from === undefined ? Infinity : plot.from;
    let high = -Infinity;
    for (const value of plot.values) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    for (const line of plot.lines || []) {
      low = Math.min(low, line);
      high = Math.max(high, line);
    }
    if (!Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
    const pad = (high - low || 1) * 0.08;
    return [plot.from === undefined ? low - pad : low, high + pad];
  }

  function drawPlot(pen, plot, top, width) {
    const [low, high] = rangeOf(plot);
    const yOf = (value) => top + plot.height - (value - low) / (high - low) * plot.height;
    pen.fillStyle = colours['--faint'];
    pen.textAlign = 'left';
    pen.fillText(plot.title, MARGIN.left, top - 6);
    pen.textAlign = 'right';
    pen.strokeStyle = colours['--rule'];
    pen.lineWidth = 1;
    for (const tick of ticks(low, high, Math.max(plot.height / 32, 2))) {
      const y = Math.round(yOf(tick)) + 0.5;
      pen.beginPath();
      pen.moveTo(MARGIN.left, y);
      pen.lineTo(width - MARGIN.right, y);
      pen.stroke();
      pen.fillText(String(tick).replace('-', '−'), MARGIN.left - 8, y + 3.5);
    }
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, top, width - MARGIN.left - MARGIN.right, plot.height);
    pen.clip();
    pen.fillStyle = colours['--band'];
    for (const turn of data.turns) {
      const from = xOf(turn.start, width);
      pen.fillRect(from, top, Math.max(xOf(turn.stop, width) - from, 1), plot.height);
    }
    pen.setLineDash([5, 4]);
    pen.strokeStyle = colours['--accent'];
    for (const line of plot.lines || []) {
      pen.beginPath();
      pen.moveTo(MARGIN.left, yOf(line));
      pen.lineTo(width - MARGIN.right, yOf(line));
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.strokeStyle = colours['--line'];
    pen.lineWidth = 1.4;
    pen.lineJoin = 'round';
    pen.beginPath();
    let pending = false;
    const first = Math.max(pairAt(shown[0]) - 1, 0);
    const last = Math.min(pairAt(shown[1]) + 1, pairs - 1);
    for (let pair = first; pair <= last; pair += 1) {
      const value = plot.values[pair];
      if (value === null) {
        pending = false;
        continue;
      }
      const x = xOf(data.seconds[pair], width);
      if (pending) pen.lineTo(x, yOf(value)); else pen.moveTo(x, yOf(value));
      pending = true;
    }
    pen.stroke();
    pen.restore();
    plot.yOf = yOf;
  }

  function drawRibbon(pen, ribbon, top, width) {
    pen.fillStyle = colours['--faint'];
    pen.textAlign = 'right';
    pen.fillText(ribbon.title, MARGIN.left - 8, top + RIBBON - 4);
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, top, width - MARGIN.left - MARGIN.right, RIBBON);
    pen.clip();
    let from = 0;
    for (let pair = 1; pair <= pairs; pair += 1) {
      if (pair < pairs && ribbon.codes[pair] === ribbon.codes[from]) continue;
      const code = Number(ribbon.codes[from]);
      const x = xOf(startOf(from), width);
      // A turn is coded on one pair: it has to be seen.
      const least = ribbon.title === 'movement' && code % 2 === 0 ? 2 : 0;
      pen.fillStyle = colours[ribbon.colours[code]];
      pen.fillRect(x, top, Math.max(xOf(data.seconds[pair - 1], width) - x, least), RIBBON);
      from = pair;
    }
    pen.restore();
  }

  function drawPlots() {
    const { pen, width } = prepare(byId('lines'), totalHeight());
    let top = 20;
    for (const plot of plots) {
      plot.top = top;
      drawPlot(pen, plot, top, width);
      top += plot.height + 26;
    }
    pen.fillStyle = colours['--line'];
    pen.textAlign = 'center';
    // Beside the title of the first plot, and so far apart that they can be read.
    let free = MARGIN.left + 110;
    for (const turn of data.turns) {
      const x = xOf((turn.start + turn.stop) / 2, width);
      if (x < free || x > width - MARGIN.right) continue;
      pen.fillText(turn.number, x, 14);
      free = x + 26;
    }
    for (const ribbon of ribbons) {
      drawRibbon(pen, ribbon, top - 10, width);
      top += RIBBON + 8;
    }
    pen.fillStyle = colours['--faint'];
    pen.textAlign = 'center';
    for (const tick of ticks(shown[0], shown[1], width / 90)) {
      pen.fillText(`${tick} s`, xOf(tick, width), top + 4);
    }
    drawCursor();
  }

  function drawCursor() {
    const { pen, width, height } = prepare(byId('cursor'), totalHeight());
    if (dragFrom !== null && dragTo !== null) {
      pen.fillStyle = colours['--band'];
      pen.fillRect(Math.min(dragFrom, dragTo), 0, Math.abs(dragTo - dragFrom), height - 22);
    }
    const x = Math.round(xOf(data.seconds[selected], width)) + 0.5;
    if (x < MARGIN.left - 1 || x > width - MARGIN.right + 1) return;
    pen.strokeStyle = colours['--ink'];
    pen.beginPath();
    pen.moveTo(x, 18);
    pen.lineTo(x, height - 22);
    pen.stroke();
    pen.fillStyle = colours['--ink'];
    for (const plot of plots) {
      const value = plot.values[selected];
      if (value === null) continue;
      pen.beginPath();
      pen.arc(x, plot.yOf(value), 3.5, 0, 7);
      pen.fill();
    }
  }

  // The drawn path, a vertex per frame, in the axes of the figure: forward is up, left is left.
  const path = data.path;
  const extent = [0, 1].map((axis) => path.reduce(
    ([low, high], vertex) => [Math.min(low, vertex[axis]), Math.max(high, vertex[axis])],
    [0, 0]));

  function drawMap() {
    const { pen, width, height } = prepare(byId('map'), 320);
    const [[left, right], [bottom, top]] = extent;
    const scale = Math.min((width - 60) / (right - left || 1), (height - 70) / (top - bottom || 1));
    const place = (index) => [
      width / 2 + (path[index][0] - (left + right) / 2) * scale,
      height / 2 - 8 - (path[index][1] - (bottom + top) / 2) * scale];
    pen.lineWidth = 3;
    pen.lineCap = 'round';
    pen.lineJoin = 'round';
    pen.strokeStyle = colours['--line'];
    pen.beginPath();
    let drawn = [-Infinity, -Infinity];
    for (let index = 0; index <= pairs; index += 1) {
      const vertex = place(index);
      // Many vertices of a long drive fall on the same pixel.
      if (index < pairs && Math.hypot(vertex[0] - drawn[0], vertex[1] - drawn[1]) < 0.5) continue;
      pen.lineTo(...vertex);
      drawn = vertex;
    }
    pen.stroke();
    const dot = (index, radius, fill, rim) => {
      pen.beginPath();
      pen.arc(...place(index), radius, 0, 7);
      pen.fillStyle = fill;
      pen.fill();
      if (rim) {
        pen.lineWidth = 2;
        pen.strokeStyle = rim;
        pen.stroke();
      }
    };
    dot(0, 6, colours['--ink']);
    const [endX, endY] = place(pairs);
    pen.fillStyle = colours['--accent'];
    pen.fillRect(endX - 6, endY - 6, 12, 12);
    pen.textAlign = 'center';
    const every = Math.ceil(data.turns.length / 60) || 1;
    data.turns.forEach((turn, index) => {
      if (index % every) return;
      dot(turn.pair, turn.number < 100 ? 9 : 12, colours['--line'], colours['--card']);
      pen.fillStyle = colours['--card'];
      pen.fillText(turn.number, place(turn.pair)[0], place(turn.pair)[1] + 4);
    });
    dot(selected + 1, 6, colours['--card'], colours['--accent']);
    let x = 4;
    pen.textAlign = 'left';
    for (const [sign, name, colour] of [
      ['●', 'start', '--ink'], ['■', 'end', '--accent'], ['○', 'cursor', '--accent']]) {
      pen.fillStyle = colours[colour];
      pen.fillText(sign, x, height - 4);
      pen.fillStyle = colours['--faint'];
      pen.fillText(name, x + 14, height - 4);
      x += 64;
    }
  }

  // The thumbnail nearest to a frame.
  function thumbnailOf(frame) {
    let best = data.thumbnails[0];
    for (const each of data.thumbnails) {
      if (Math.abs(each.frame - frame) < Math.abs(best.frame - frame)) best = each;
    }
    return best;
  }

  function show(list) {
    byId('readout').replaceChildren(...list.map(([name, value]) => {
      const item = document.createElement('div');
      const term = document.createElement('dt');
      const description = document.createElement('dd');
      term.textContent = name;
      description.textContent = value;
      item.append(term, description);
      return item;
    }));
  }

  const fixed = (value, digits, unit) => (value === null ? 'not measured'
    : `${value.toFixed(digits).replace('-', '−')}${unit}`);

  function select(pair) {
    selected = Math.min(Math.max(pair, 0), pairs - 1);
    const frame = selected + 1;
    const image = byId('frame');
    if (data.thumbnails.length) {
      const thumbnail = thumbnailOf(frame);
      if (image.dataset.frame !== String(thumbnail.frame)) {
        image.src = thumbnail.src;
        image.dataset.frame = thumbnail.frame;
      }
    }
    byId('caption').textContent = `Frame ${image.dataset.frame || frame} of ${pairs + 1}`;
    const turn = data.turns.find((each) => each.pair <= selected && selected <= each.end);
    byId('badge').textContent = turn ? `turn ${turn.number}, ${turn.side}` : '';
    const list = [
      ['time', `${data.seconds[selected].toFixed(2)} s`],
      ['frame', String(frame)],
      ['shift', fixed(data.dx[selected], 1, ' px')],
      ['response', fixed(data.response[selected], 3, '')],
      ['movement', `${data.movement[selected]} ${data.movements[data.movement[selected]]}`],
      ['direction', `${data.direction[selected]} ${data.directions[data.direction[selected]]}`],
      ['status', data.statuses[data.status[selected]]],
    ];
    if (data.heading) list.push(['heading', fixed(data.heading[selected], 1, '°')]);
    if (data.speed) {
      list.push(['speed', fixed(data.speed[selected], 2, ` ${data.speed_unit}`)],
        ['distance', data.distance_state[selected]]);
    }
    show(list);
    const slider = byId('plots');
    slider.setAttribute('aria-valuenow', selected);
    slider.setAttribute('aria-valuetext', `${data.seconds[selected].toFixed(2)} seconds`);
    drawCursor();
    drawMap();
  }

  function zoom(from, to) {
    shown = to - from > 0 ? [from, to] : [0, end];
    drawPlots();
  }

  function listen() {
    const box = byId('plots');
    const xIn = (event) => event.clientX - box.getBoundingClientRect().left;
    box.setAttribute('aria-valuemax', pairs - 1);
    box.addEventListener('pointermove', (event) => {
      if (dragFrom !== null) dragTo = xIn(event);
      select(pairAt(secondsAt(xIn(event), box.clientWidth)));
    });
    box.addEventListener('pointerdown', (event) => {
      dragFrom = xIn(event);
      dragTo = null;
    });
    window.addEventListener('pointerup', () => {
      const [from, to] = [Math.min(dragFrom, dragTo), Math.max(dragFrom, dragTo)];
      const wanted = dragFrom !== null && dragTo !== null && to - from > 8;
      dragFrom = null;
      dragTo = null;
      if (wanted) {
        zoom(
          Math.max(secondsAt(from, box.clientWidth), 0),
          Math.min(secondsAt(to, box.clientWidth), end));
      } else {
        drawCursor();
      }
    });
    box.addEventListener('dblclick', () => zoom(0, end));
    box.addEventListener('keydown', (event) => {
      const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10,
        Home: -pairs, End: pairs };
      if (!(event.key in steps)) return;
      event.preventDefault();
      select(selected + steps[event.key]);
    });
    for (const button of document.querySelectorAll('.turns button')) {
      button.addEventListener('click', () => {
        zoom(0, end);
        select(data.turns[Number(button.dataset.turn)].pair);
        window.scrollTo({ top: 0, behavior: 'smooth' });
      });
    }
    new ResizeObserver(redraw).observe(box);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  }

  function fillStrips() {
    if (!data.thumbnails.length) return;
    for (const strip of document.querySelectorAll('.turns [data-strip]')) {
      const turn = data.turns[Number(strip.dataset.strip)];
      const frames = [turn.pair, Math.round((turn.pair + turn.end + 1) / 2), turn.end + 1];
      for (const thumbnail of new Set(frames.map(thumbnailOf))) {
        const image = document.createElement('img');
        image.src = thumbnail.src;
        image.alt = image.title = `frame ${thumbnail.frame}`;
        strip.append(image);
      }
    }
  }

  function redraw() {
    drawPlots();
    drawMap();
  }

  fillStrips();
  listen();
  drawPlots();
  select(data.turns.length ? data.turns[0].pair : 0);
})();
