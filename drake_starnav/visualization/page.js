const starnav = (function () {
  const settings = SETTINGS;
  const element = (name) => document.getElementById('starnav-' + name);
  const [clock, play, bar, scale] = ['clock', 'play', 'time', 'scale'].map(element);
  const [pane, animator] = [viewer.dom_element, viewer.animator];
  const buttons = document.querySelectorAll('#starnav-views button');
  const drawn = (p) => [p[0], p[2], -p[1]];  // three.js has y up
  const INSIDE = 1e-4;  // s: keyframes are rounded to single precision, a time just before one would show the last frame
  let view = settings.view, at = null, held = '', turned = false;  // turned: by hand, since the last preset

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
  // As `camera_pose`, for the scene's present size.
  function camera(name) {
    const [x0, y0, x1, y1] = settings.extents[name];
    const [width, height] = [pane.offsetWidth, pane.offsetHeight];
    let [across, along, up] = [x1 - x0, y1 - y0, [0, 1]];
    if (width >= height ? along > across : along < across) [across, along, up] = [along, across, [-1, 0]];
    const tilt = Math.PI / 180 * settings.tilts[name];
    const half = Math.tan(Math.PI / 360 * settings.field_of_view);
    const high = settings.spare * Math.max(Math.cos(tilt) * along, across * height / width);
    const distance = 0.5 * high / half + 0.5 * Math.sin(tilt) * along + settings.tall;
    const middle = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
    const away = distance * Math.sin(tilt);
    const position = [middle[0] - away * up[0], middle[1] - away * up[1], distance * Math.cos(tilt)];
    return {position, target: [...middle, 0], distance};
  }
  function look(name) {
    view = name;
    const {position, target, distance} = camera(name);
    // A near plane that is not too near keeps flat layers a centimetre apart from flickering.
    Object.assign(viewer.camera, {fov: settings.field_of_view, near: 0.02 * distance, far: 10 * distance});
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
    held = '';
  }

  function drawScale() {
    const distance = viewer.camera.position.distanceTo(viewer.controls.target);
    const pixels = pane.offsetHeight / (2 * Math.tan(Math.PI / 360 * viewer.camera.fov) * distance);
    const longest = Math.min(settings.scale_width, 0.25 * pane.offsetWidth) / pixels;
    const power = 10 ** Math.floor(Math.log10(longest));
    const meters = power * Math.max(...[1, 2, 5].filter(step => step * power <= longest * (1 + 1e-9)));
    scale.style.width = meters * pixels + 'px';
    scale.firstChild.textContent = (meters < 1 ? Math.round(100 * meters) + ' cm' : meters + ' m');
  }
  const playing = (so) => play.classList.toggle('playing', so);
  function update() {
    if (!turned && held !== stand()) look(view);  // the scene came later, or has another size
    if (!settings.live) {
      clock.textContent = 't = ' + animator.time.toFixed(1) + ' s';
      bar.max = animator.duration;
      bar.value = animator.time;
      playing(animator.playing);
    }
    drawScale();
    if (at !== null) {
      const now = followed();
      if (now.some((x, i) => x !== at[i])) move(now.map((x, i) => x - at[i]));
      at = now;
    }
    // Or points are drawn in the wrong size in the first frame that shows them.
    viewer.scene.traverse(o => {
      if (o.isPoints && !o.userData.fresh) { o.userData.fresh = true; o.material.needsUpdate = true; }
    });
  }
  function show(seconds) {
    animator.pause();
    animator.seek(seconds);
    update();
    viewer.render();
  }

  function press(name) {
    viewer.connection.send(MeshCat.msgpack.encode({type: 'button', name: name}));
  }
  async function follow_run() {
    try {
      const state = await (await fetch('state')).json();
      clock.textContent = 't = ' + state.time.toFixed(1) + ' s';
      element('said').textContent = state.said;
      playing(state.running);
      play.title = state.running ? 'pause (space)' : 'start (s)';
      play.disabled = state.ended;
    } catch (error) {
      element('said').textContent += ' (the program has ended)';
      play.disabled = true;
    }
    if (!play.disabled) setTimeout(follow_run, 200);
  }

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
  if (settings.live) {
    document.body.classList.add('live');
    Object.values(viewer.gui.__folders).forEach(folder => folder.close());  // or the goal's sliders were far below
  }
  element('controls').open = settings.live;
  bar.hidden = settings.live;
  bar.onpointerdown = () => animator.pause();
  bar.oninput = () => { animator.pause(); animator.seek(bar.valueAsNumber); };
  play.onclick = () => {
    play.blur();  // or the space bar would press it again
    if (settings.live) press(play.classList.contains('playing') ? 'pause' : 'start');
    else if (animator.playing) animator.pause();
    else animator.play();
  };
  for (const event of ['pointerdown', 'wheel']) pane.addEventListener(event, () => { turned = true; });
  new ResizeObserver(resize).observe(pane);
  resize();
  look(view);
  const tick = () => { update(); requestAnimationFrame(tick); };
  tick();
  if (settings.live) follow_run();
  return {show, look, followed};
})();
