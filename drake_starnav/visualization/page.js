const starnav = (function () {
  const settings = SETTINGS;
  // Degrees: of the camera, narrow, so that tall obstacles seen from above hide little; and of each preset's line of
  // sight from straight down; at 0 the direction "up" would be undefined.
  const [FIELD_OF_VIEW, TILTS] = [20, {top: 0.05, follow: 35, oblique: 50}];
  const [WALL, FAINT] = [1.0, 0.3];  // what is taller, m, hides a robot seen from aside, and is drawn so opaque then
  const [SPARE, TALL] = [1.04, 0.5];  // presets show so much more than their box, and the tops of obstacles so high, m
  const SCALE_WIDTH = 120;  // greatest width of the scale bar, pixels
  const element = (name) => document.getElementById('starnav-' + name);
  const [clock, play, bar, scale] = ['clock', 'play', 'time', 'scale'].map(element);
  const [pane, animator] = [viewer.dom_element, viewer.animator];
  const buttons = document.querySelectorAll('#starnav-views button');
  const drawn = (p) => [p[0], p[2], -p[1]];  // three.js has y up
  const INSIDE = 1e-4;  // s: keyframes are rounded to single precision, a time just before one would show the last frame
  let view = settings.view, at = null, held = '';
  let turned = view === 'own';  // by hand since the last preset, or by who made the page

  // One clock for all objects: Meshcat gives each its own, and those that have ended stay behind after a seek.
  function pose(seconds) {
    const time = Math.max(0, Math.min(animator.duration, seconds));
    for (const action of animator.actions) {
      action.play();
      action.time = Math.min(action.getClip().duration, time + INSIDE);
    }
    animator.mixer.update(0);
    animator.display_progress(time);
    viewer.set_dirty();
  }
  const inherited = Object.getPrototypeOf(animator);
  Object.assign(animator, {
    seek: pose,
    play() {
      if (animator.time >= animator.duration) pose(0);
      inherited.play.call(animator);
    },
    reset() {
      pose(0);
      animator.setup_capturer(animator.capturer.format);
    },
    update() {
      if (!animator.playing) return;
      pose(animator.time + animator.clock.getDelta() * animator.mixer.timeScale);
      if (animator.time >= animator.duration) animator.pause();
    },
  });

  function followed() {
    viewer.scene.updateMatrixWorld(true);
    const e = viewer.scene_tree.find(settings.followed).object.matrixWorld.elements;
    return [e[12], 0, e[14]];
  }
  function move(by) {
    const target = viewer.controls.target.toArray().map((x, i) => x + by[i]);
    viewer.camera.position.fromArray(viewer.camera.position.toArray().map((x, i) => x + by[i]));
    viewer.set_camera_target(target);
    viewer.controls.update();
    viewer.set_dirty();
    held = stand();
  }
  const stand = () => viewer.camera.position.toArray().join();
  // A preset fills the scene, whatever its size, with a box of the floor, whose longer side lies across.
  function camera(name) {
    const [x0, y0, x1, y1] = settings.extents[name];
    const [width, height] = [pane.offsetWidth, pane.offsetHeight];
    let [across, along, up] = [x1 - x0, y1 - y0, [0, 1]];
    if (width >= height ? along > across : along < across) [across, along, up] = [along, across, [-1, 0]];
    const tilt = Math.PI / 180 * TILTS[name];
    const half = Math.tan(Math.PI / 360 * FIELD_OF_VIEW);
    const high = SPARE * Math.max(Math.cos(tilt) * along, across * height / width);
    const distance = 0.5 * high / half + 0.5 * Math.sin(tilt) * along + TALL;
    const middle = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
    const away = distance * Math.sin(tilt);
    const position = [middle[0] - away * up[0], middle[1] - away * up[1], distance * Math.cos(tilt)];
    return {position, target: [...middle, 0], distance};
  }
  function look(name) {
    view = name;
    const {position, target, distance} = camera(name);
    // A near plane that is not too near keeps flat layers a centimetre apart from flickering.
    Object.assign(viewer.camera, {fov: FIELD_OF_VIEW, near: 0.02 * distance, far: 10 * distance});
    viewer.camera.updateProjectionMatrix();
    viewer.camera.position.fromArray(drawn(position));
    viewer.set_camera_target(drawn(target));
    viewer.controls.update();
    viewer.set_dirty();
    [held, turned] = [stand(), false];
    at = name === 'follow' ? drawn(settings.start) : null;  // `update` moves on to where the robot is
    buttons.forEach(b => b.className = b.textContent === name ? 'on' : '');
  }
  function resize() {
    viewer.set_3d_pane_size();
    if (!turned) look(view);
    viewer.render();
  }

  // Where the pane shows a point of W.
  function shown(p) {
    const {x, y} = viewer.camera.position.clone().set(...drawn(p)).project(viewer.camera);
    return [0.5 * (1 + x) * pane.offsetWidth, 0.5 * (1 - y) * pane.offsetHeight];
  }
  // How the pane shows the axes of W, pixels per metre, at the camera's target.
  function axes() {
    const {x, z} = viewer.controls.target;
    const from = shown([x, -z, 0]);
    return [[x + 1, -z, 0], [x, -z + 1, 0]].map(p => shown(p).map((a, i) => a - from[i]));
  }
  function drawAxes() {
    const both = axes();
    const length = 30 / Math.max(...both.map(d => Math.hypot(...d)));
    ['x', 'y'].forEach((name, k) => {
      const [dx, dy] = both[k].map(a => a * length);
      const [ex, ey] = [42 + dx, 42 + dy];
      const barb = (side) => `M${ex} ${ey}L${ex - 0.25 * dx + side * 0.12 * dy} ${ey - 0.25 * dy - side * 0.12 * dx}`;
      element(name).setAttribute('d', `M42 42L${ex} ${ey}${barb(1)}${barb(-1)}`);
      element(name + '-name').setAttribute('x', 42 + 1.25 * dx);
      element(name + '-name').setAttribute('y', 42 + 1.25 * dy);
    });
  }

  function drawScale() {
    const distance = viewer.camera.position.distanceTo(viewer.controls.target);
    const pixels = pane.offsetHeight / (2 * Math.tan(Math.PI / 360 * viewer.camera.fov) * distance);
    const longest = Math.min(SCALE_WIDTH, 0.25 * pane.offsetWidth) / pixels;
    const power = 10 ** Math.floor(Math.log10(longest));
    const meters = power * Math.max(...[1, 2, 5].filter(step => step * power <= longest * (1 + 1e-9)));
    scale.style.width = meters * pixels + 'px';
    scale.firstChild.textContent = (meters < 1 ? Math.round(100 * meters) + ' cm' : meters + ' m');
  }
  function update() {
    if (!turned && held !== stand()) look(view);  // the scene came later
    clock.textContent = 't = ' + animator.time.toFixed(1) + ' s';
    bar.max = animator.duration;
    bar.value = animator.time;
    play.classList.toggle('playing', animator.playing);
    drawScale();
    drawAxes();
    if (at !== null) {
      const now = followed();
      if (now.some((x, i) => x !== at[i])) move(now.map((x, i) => x - at[i]));
      at = now;
    }
    viewer.scene.traverse(o => {
      // Or points are drawn in the wrong size in the first frame that shows them.
      if (o.isPoints && !o.userData.fresh) { o.userData.fresh = true; o.material.needsUpdate = true; }
    });
    seeThrough(turned || view !== 'top');
  }
  function show(seconds) {
    animator.pause();
    animator.seek(seconds);
    update();
    viewer.render();
  }

  // From aside, what is as tall as a wall is translucent, or it would hide the robot.
  function seeThrough(aside) {
    const robot = nodeAt(settings.followed.slice(0, Math.max(2, settings.followed.length - 1)));  // all its links
    nodeAt(['world'])?.object.traverse(o => {
      if (!o.isMesh || o.userData.translucent === aside) return;
      for (let parent = o; parent; parent = parent.parent) if (robot && parent === robot.object) return;
      if (!o.geometry.boundingBox) o.geometry.computeBoundingBox();  // once, not in each frame
      if (o.geometry.boundingBox.clone().applyMatrix4(o.matrixWorld).max.y < WALL) return;
      o.userData.translucent = aside;
      for (const material of [o.material].flat()) {
        material.userData.look ??= [material.transparent, material.opacity, material.depthWrite];
        const [transparent, opacity, depthWrite] = aside ? [true, FAINT, false] : material.userData.look;
        Object.assign(material, {transparent, opacity, depthWrite, needsUpdate: true});
      }
      viewer.set_dirty();
    });
  }
  const nodeAt = (path) => path.reduce((node, name) => node?.children[name], viewer.scene_tree);

  function toggle(row) {
    viewer.set_property(JSON.parse(row.dataset.path), 'visible', !row.classList.toggle('off'));
  }
  for (const row of document.querySelectorAll('#starnav-legend tr[data-path]')) {
    if (row.classList.contains('off')) viewer.set_property(JSON.parse(row.dataset.path), 'visible', false);
    row.onclick = () => toggle(row);
  }
  element('legend').open = window.innerWidth > 700;
  element('controls').append(viewer.gui.domElement);
  viewer.gui.open();  // the panel folds it
  bar.onpointerdown = () => animator.pause();
  bar.oninput = () => { animator.pause(); animator.seek(bar.valueAsNumber); };
  play.onclick = () => {
    play.blur();  // or the space bar would press it again
    if (animator.playing) animator.pause();
    else animator.play();
  };
  pane.addEventListener('wheel', () => { turned = true; });
  document.addEventListener('pointermove', event => { if (event.buttons && pane.contains(event.target)) turned = true; });
  new ResizeObserver(resize).observe(pane);
  resize();
  if (!turned) look(view);
  const tick = () => { update(); requestAnimationFrame(tick); };
  tick();
  return {show, look, followed};
})();
