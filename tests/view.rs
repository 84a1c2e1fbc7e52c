//! `marmor view` as a user has it: a window under Xvfb, real input, and pictures that `marmor render` draws as well.
//!
//! `MARMOR_UPDATE_SCREENSHOTS=1 cargo test --release --test view screenshots` writes those of the documentation anew.

mod common;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use common::device::{self, set};
use common::program::{folder, marmor, run};
use common::shaders;
use image::{RgbImage, RgbaImage};
use marmor::cpu::compose::Composed;
use marmor::cpu::resolve::encode_srgb;
use marmor::frame::Options;
use marmor::scene::{Light, Request, Viewpoint};
use marmor::view::session::{BACKDROP, Session};

/// Longer than two shared cores take for any one picture of these, by far.
const PATIENCE: Duration = Duration::from_secs(60);

/// What the tests need besides the device, and what Debian calls it.
const TOOLS: [(&str, &str); 3] = [
    ("Xvfb", "xvfb"),
    ("xdotool", "xdotool"),
    ("import", "imagemagick"),
];

/// Sends the message by which a window manager closes a window, of which none runs here, and which old versions of
/// xdotool cannot send.
const CLOSE: &str = r#"
import ctypes, sys
x = ctypes.CDLL("libX11.so.6")
x.XOpenDisplay.restype = ctypes.c_void_p
x.XInternAtom.restype = ctypes.c_ulong
class Message(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("sent", ctypes.c_int),
                ("display", ctypes.c_void_p), ("window", ctypes.c_ulong), ("kind", ctypes.c_ulong),
                ("format", ctypes.c_int), ("data", ctypes.c_long * 5), ("rest", ctypes.c_long * 24)]
display = ctypes.c_void_p(x.XOpenDisplay(None))
atom = lambda name: x.XInternAtom(display, name, 0)
window = int(sys.argv[1])
message = Message(33, 0, 1, display, window, atom(b"WM_PROTOCOLS"), 32, (atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0))
x.XSendEvent(display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(message))
x.XSync(display, 0)
"#;

/// An X server without a screen to see. It ends with the test.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// None, where a tool is missing and MARMOR_REQUIRE_DEVICE is not set.
    fn open(screen: &str) -> Option<Display> {
        for (tool, package) in TOOLS {
            let found = std::env::var_os("PATH").is_some_and(|path| {
                std::env::split_paths(&path).any(|folder| folder.join(tool).exists())
            });
            if !found {
                let remedy = format!("{tool} is missing: install {package}");
                assert!(!set("MARMOR_REQUIRE_DEVICE"), "{remedy}");
                eprintln!("skipped: {remedy}");
                return None;
            }
        }
        // The server chooses a number that is free, and says it once it listens.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"])
            .args(["-screen", "0", screen])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb runs");
        let mut number = String::new();
        let out = server.stdout.take().expect("its output");
        BufReader::new(out).read_line(&mut number).expect("a line");
        let name = format!(":{}", number.trim());
        assert!(name.len() > 1, "Xvfb opens no display");
        Some(Display { server, name })
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.name);
        command
    }

    /// What stands on the screen.
    fn capture(&self, folder: &Path) -> RgbImage {
        let path = folder.join("screen.png");
        let mut import = self.command("import");
        import.args(["-window", "root", "-depth", "8"]).arg(&path);
        assert!(import.status().expect("import runs").success());
        image::open(&path).expect("a capture").into_rgb8()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The viewer, and what it has said.
struct Viewer<'a> {
    display: &'a Display,
    program: Child,
    lines: Receiver<String>,
    said: Vec<String>,
    window: String,
    folder: PathBuf,
}

impl<'a> Viewer<'a> {
    fn open(display: &'a Display, folder: &Path, arguments: &[&str]) -> Viewer<'a> {
        let mut program = marmor()
            .env("DISPLAY", &display.name)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            // A message that comes too late to be counted aborts.
            .env("MARMOR_REQUIRE_VALIDATION", "1")
            .current_dir(folder)
            .args(["view", "-v", "--validation", "--saves", "saves"])
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        let (sender, lines) = channel();
        let out = BufReader::new(program.stderr.take().expect("its messages"));
        thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let mut viewer = Viewer {
            display,
            program,
            lines,
            said: Vec::new(),
            window: String::new(),
            folder: folder.to_owned(),
        };
        viewer.wait("window: ");
        let mut search = display.command("xdotool");
        let search = search.args(["search", "--sync", "--onlyvisible", "--name", "^marmor$"]);
        let found = search.output().expect("xdotool runs").stdout;
        viewer.window = String::from_utf8_lossy(&found)
            .lines()
            .next()
            .expect("a window")
            .to_owned();
        viewer.focus();
        viewer
    }

    /// Waits for a line with `words` that it has not said before; returns what follows them.
    fn wait(&mut self, words: &str) -> String {
        let start = Instant::now();
        loop {
            let left = PATIENCE.saturating_sub(start.elapsed());
            match self.lines.recv_timeout(left) {
                Ok(line) => {
                    self.said.push(line.clone());
                    if let Some((_, rest)) = line.split_once(words) {
                        return rest.to_owned();
                    }
                }
                Err(error) => {
                    let ended = error == RecvTimeoutError::Disconnected;
                    panic!(
                        "no \"{words}\" {}, after:\n{}",
                        if ended { "before its end" } else { "in time" },
                        self.said.join("\n")
                    )
                }
            }
        }
    }

    /// Waits for a whole picture; returns its size.
    fn whole(&mut self) -> [u32; 2] {
        let words = self.wait("still: ");
        let size = words.split(", ").nth(1).expect("a size");
        let size = size.trim_end_matches(" pixels").split_once('x');
        let (width, height) = size.expect("columns and rows");
        [width, height].map(|side| side.parse().expect("a number"))
    }

    fn xdotool(&self, arguments: &[&str]) {
        let mut xdotool = self.display.command("xdotool");
        let status = xdotool.args(arguments).status().expect("xdotool runs");
        assert!(status.success(), "xdotool {arguments:?}");
    }

    /// No window manager runs that would do it.
    fn focus(&self) {
        self.xdotool(&["windowfocus", "--sync", &self.window]);
    }

    fn key(&self, key: &str) {
        self.xdotool(&["key", key]);
    }

    /// Drags with `button` in steps, as a hand does.
    fn drag(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let [x, y] = from.map(|at| at.to_string());
        self.xdotool(&["mousemove", &x, &y, "mousedown", button]);
        let steps = 8;
        for step in 1..=steps {
            let at = |i: usize| (from[i] + (to[i] - from[i]) * step / steps).to_string();
            self.xdotool(&["sleep", "0.05", "mousemove", &at(0), &at(1)]);
        }
        self.xdotool(&["mouseup", button]);
    }

    /// Drags with `button` so fast that no frame comes between.
    fn flick(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let ([x, y], [u, v]) = (from.map(|at| at.to_string()), to.map(|at| at.to_string()));
        let down = ["mousemove", &x, &y, "mousedown", button];
        let up = ["mousemove", &u, &v, "mouseup", button];
        self.xdotool(&[down, up].concat());
    }

    /// Presses P; returns the scene that was saved, and the path of its PNG.
    fn save(&mut self) -> (Request, PathBuf) {
        self.key("p");
        let name = self.wait("saved ");
        let path = self.folder.join(name);
        let scene = Request::open(&path.with_extension("toml")).expect("a scene");
        (scene, path)
    }

    /// Ends it by `close`, and asks for a clean end. Returns how many frames it drew.
    fn end(mut self, close: impl FnOnce(&Self)) -> u64 {
        close(&self);
        let closed = self.wait("closed: ");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.program.try_wait().expect("a status") {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "closed, but does not end");
            thread::sleep(Duration::from_millis(20));
        };
        self.said.extend(self.lines.try_iter());
        let said = self.said.join("\n");
        assert!(status.success(), "{status} after:\n{said}");
        assert!(!said.contains("validation: "), "{said}");
        assert!(closed.ends_with(", 0 validation messages"), "{said}");
        let frames = closed.split(' ').next().expect("a number");
        frames.parse().expect("how many frames")
    }
}

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Draws with `marmor render` into `folder`.
fn render(folder: &Path, arguments: &[&str], name: &str) -> PathBuf {
    let mut all = vec!["render", "-q", "-o", name];
    all.extend(arguments);
    let ran = run(folder, &all);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    folder.join(name)
}

/// Holds the screen's upper left to a picture (PNG) over the backdrop.
fn holds(what: &str, screen: &RgbImage, picture: &Path) {
    let picture: RgbaImage = image::open(picture).expect("a picture").into_rgba8();
    let texels: Vec<[u8; 4]> = picture.pixels().map(|pixel| pixel.0).collect();
    let (width, height) = picture.dimensions();
    let composed = Composed {
        size: [width as usize, height as usize],
        picture: &texels,
        place: [0, 0, width as i32, height as i32],
        backdrop: BACKDROP.map(f64::from),
    };
    let (mut off, mut covered) = (0, 0);
    for (x, y, pixel) in picture.enumerate_pixels() {
        let wanted = composed.at([x as usize, y as usize]);
        let wanted = wanted.map(|value| (255.0 * encode_srgb(value)).round() as u8);
        let found = screen.get_pixel(x, y).0;
        // f32 and the device's own sRGB, or its rounding, against f64: a step where a value lies at its edge.
        let most = (0..3).map(|c| wanted[c].abs_diff(found[c])).max();
        let most = most.unwrap_or_default();
        assert!(most <= 1, "{what}: ({x}, {y}) is {found:?}, not {wanted:?}");
        off += u32::from(most > 0);
        covered += u32::from(pixel.0[3] > 0);
    }
    println!("{what}: {off} of {} pixels are one off", width * height);
    assert!(covered > width * height / 20, "{what}: nothing is seen");
}

/// Holds a saved picture to what `marmor render` draws from the scene beside it.
fn reproduces(folder: &Path, saved: &Path) {
    let scene = saved.with_extension("toml");
    let scene = scene.to_string_lossy();
    let pixels = |path: &Path| image::open(path).expect("a picture").into_rgba32f();
    for end in ["png", "exr"] {
        let again = render(folder, &[&scene], &format!("again.{end}"));
        let (saved, again) = (pixels(&saved.with_extension(end)), pixels(&again));
        assert_eq!(saved.dimensions(), again.dimensions(), "{end}");
        let differ = saved.pixels().zip(again.pixels()).filter(|(a, b)| a != b);
        assert_eq!(differ.count(), 0, "pixels of the {end} differ");
    }
}

#[test]
fn what_one_does_in_the_window_is_what_render_draws() {
    if !device::present() {
        return;
    }
    let Some(display) = Display::open("1280x800x24") else {
        return;
    };
    let folder = folder();
    let folder = folder.path();
    let flags = ["statue-1k", "--frames-averaged", "4"];
    let mut arguments = flags.to_vec();
    arguments.extend(["--window", "760x560"]);
    let mut viewer = Viewer::open(&display, folder, &arguments);

    // As it opens, with the panel at the right and the costs below.
    let [width, height] = viewer.whole();
    assert!(width < 760 && height < 560, "{width}x{height}");
    let size = format!("{width}x{height}");
    let mut arguments = flags.to_vec();
    arguments.extend(["--size", &size]);
    let own = render(folder, &arguments, "own.png");
    holds("opened", &display.capture(folder), &own);
    let (first, saved) = viewer.save();
    reproduces(folder, &saved);
    assert_eq!(
        fs::read(&own).expect("a file"),
        fs::read(&saved).expect("a file")
    );

    // A drag of the light.
    let by = [120, 60];
    viewer.drag("3", [100, 100], [100 + by[0], 100 + by[1]]);
    viewer.whole();
    let (lit, saved) = viewer.save();
    let Light {
        azimuth, elevation, ..
    } = lit.light;
    let turned = [
        azimuth - first.light.azimuth,
        first.light.elevation - elevation,
    ];
    for (turned, by) in turned.into_iter().zip(by) {
        let whole = 0.4 * f64::from(by);
        assert!((turned - whole).abs() < 1e-9, "{turned} of {whole}");
    }
    reproduces(folder, &saved);
    holds("lit", &display.capture(folder), &saved);

    // A drag of the camera, and the wheel.
    viewer.flick("1", [100, 100], [160, 110]);
    viewer.whole();
    let (turned, _) = viewer.save();
    assert_eq!(turned.light, lit.light);
    let orbits = [&lit, &turned].map(|request| match request.viewpoint {
        Viewpoint::Orbit {
            azimuth,
            elevation,
            distance,
            ..
        } => (azimuth, elevation, distance),
        Viewpoint::At { .. } => unreachable!("a camera that orbits"),
    });
    let [
        (azimuth, elevation, _),
        (turned_azimuth, turned_elevation, near),
    ] = orbits;
    assert!(
        (azimuth - turned_azimuth - 0.3 * 60.0).abs() < 1e-9,
        "{turned_azimuth}"
    );
    assert!(
        (turned_elevation - elevation - 0.3 * 10.0).abs() < 1e-9,
        "{turned_elevation}"
    );
    viewer.xdotool(&["click", "4"]);
    viewer.whole();
    let (turned, saved) = viewer.save();
    let distance = match turned.viewpoint {
        Viewpoint::Orbit { distance, .. } => distance,
        Viewpoint::At { .. } => None,
    };
    assert!(
        distance < near && distance.is_some(),
        "{distance:?} of {near:?}"
    );
    reproduces(folder, &saved);

    // Keys, all within a frame: five degrees each.
    viewer.xdotool(&["key", "Left", "Left", "Left", "Up", "m"]);
    viewer.whole();
    let (method, saved) = viewer.save();
    assert_ne!(method.multiple, turned.multiple);
    let by = [
        method.light.azimuth - turned.light.azimuth,
        method.light.elevation - turned.light.elevation,
    ];
    assert!(
        (by[0] + 15.0).abs() < 1e-9 && (by[1] - 5.0).abs() < 1e-9,
        "{by:?}"
    );
    reproduces(folder, &saved);
    holds("another method", &display.capture(folder), &saved);

    // The line stands in the middle, and follows.
    viewer.key("s");
    viewer.whole();
    let middle = (width / 2) as i32;
    viewer.drag("1", [middle, 200], [middle - 80, 200]);
    viewer.whole();
    let (split, saved) = viewer.save();
    assert!(split.split.is_some());
    let wanted = 0.5 - 80.0 / f64::from(width);
    // The pointer stands on whole pixels.
    assert!(
        (split.split_at - wanted).abs() < 2.0 / f64::from(width),
        "{}",
        split.split_at
    );
    reproduces(folder, &saved);
    viewer.key("s");
    viewer.whole();

    // Too small for the panel, the window is all picture.
    viewer.xdotool(&["windowsize", &viewer.window, "500", "380"]);
    assert_eq!(viewer.whole(), [500, 380]);
    let (small, saved) = viewer.save();
    assert_eq!(small.size, [500, 380]);
    reproduces(folder, &saved);
    holds("resized", &display.capture(folder), &saved);

    // Minimised, it comes back as it was.
    viewer.xdotool(&["windowunmap", "--sync", &viewer.window]);
    thread::sleep(Duration::from_millis(500));
    viewer.xdotool(&["windowmap", "--sync", &viewer.window]);
    viewer.focus();
    let (again, saved) = viewer.save();
    assert_eq!(again, small);
    let start = Instant::now();
    // The server cleared the window; it is drawn at the next turn.
    while display.capture(folder).get_pixel(0, 0).0 == [0; 3] && start.elapsed() < PATIENCE {}
    holds("restored", &display.capture(folder), &saved);

    viewer.end(|viewer| viewer.key("ctrl+q"));
}

#[test]
fn what_moves_plays() {
    if !device::present() {
        return;
    }
    let Some(display) = Display::open("640x480x24") else {
        return;
    };
    let folder = folder();
    let folder = folder.path();
    let mut viewer = Viewer::open(&display, folder, &["betta", "--window", "480x320"]);
    let mut before = display.capture(folder);
    let start = Instant::now();
    let mut changes = 0;
    while changes < 4 {
        assert!(
            start.elapsed() < PATIENCE,
            "it stands still: {:?}",
            viewer.said
        );
        let now = display.capture(folder);
        changes += u32::from(now != before);
        before = now;
    }
    // It stands still when asked to, and the picture of that instant is saved.
    viewer.key("space");
    viewer.key("p");
    viewer.whole();
    viewer.wait("saved ");
    let frames = viewer.end(|viewer| {
        let mut python = display.command("python3");
        let close = python.args(["-c", CLOSE, &viewer.window]);
        assert!(close.status().expect("python runs").success());
    });
    assert!(frames >= 4, "{frames} frames");
}

#[test]
fn shaders_of_the_window_reload_as_those_of_the_picture_do() {
    if !device::present() {
        return;
    }
    let Some(display) = Display::open("480x320x24") else {
        return;
    };
    let folder = folder();
    let folder = folder.path();
    let copy = shaders::copy();
    let watched = copy.path().to_str().expect("a path");
    let arguments = ["statue-1k", "--frames-averaged", "2", "--window", "480x320"];
    let mut viewer = Viewer::open(
        &display,
        folder,
        &[&arguments[..], &["--watch", watched]].concat(),
    );
    viewer.whole();
    let screen_turns = |wanted: &dyn Fn([u8; 3]) -> bool| {
        let start = Instant::now();
        // Beside the object, where nothing is written.
        while !wanted(display.capture(folder).get_pixel(3, 3).0) {
            assert!(start.elapsed() < PATIENCE, "the screen stays as it is");
        }
    };
    let backdrop = BACKDROP.map(|value| (255.0 * encode_srgb(f64::from(value))).round() as u8);
    screen_turns(&|pixel| pixel == backdrop);
    // An error is told, and what was there draws on.
    let (end, wrong) = ("stored(color), 1.0", "stored(colour), 1.0");
    shaders::replace(copy.path(), "compose.frag", end, wrong);
    viewer.wait("compose.frag:23: error: 'colour'");
    viewer.whole();
    assert_eq!(display.capture(folder).get_pixel(3, 3).0, backdrop);
    // It can be saved, now and after what comes next.
    let (_, saved) = viewer.save();
    reproduces(folder, &saved);
    viewer.flick("3", [200, 100], [240, 120]);
    viewer.whole();
    let (_, saved) = viewer.save();
    reproduces(folder, &saved);
    let red = "vec3(1.0, 0.0, 0.0), 1.0";
    shaders::replace(copy.path(), "compose.frag", wrong, red);
    screen_turns(&|pixel| pixel == [255, 0, 0]);
    shaders::replace(copy.path(), "compose.frag", red, end);
    screen_turns(&|pixel| pixel == backdrop);
    // Those of the picture as well.
    let encoded = "vec4(encode_srgb(clamp(color, 0.0, 1.0)), alpha)";
    // A method that was not drawn before is drawn by older ones, too.
    let wrong = "vec4(encode_srgb(clamp(colour, 0.0, 1.0)), alpha)";
    shaders::replace(copy.path(), "resolve.frag", encoded, wrong);
    viewer.wait("error: 'colour'");
    viewer.whole();
    viewer.key("m");
    viewer.whole();
    let (_, saved) = viewer.save();
    reproduces(folder, &saved);
    let green = "vec4(0.0, 1.0, 0.0, 1.0)";
    shaders::replace(copy.path(), "resolve.frag", wrong, green);
    screen_turns(&|pixel| pixel == [0, 255, 0]);
    viewer.end(|viewer| viewer.key("ctrl+q"));
}

fn options() -> Options {
    Options {
        device: None,
        validation: false,
        measure: false,
        memory_limit: None,
        redraw_light: false,
    }
}

/// What a dropped file does, which nothing here can drop.
#[test]
fn another_scene_opens_in_place_of_this_one() {
    let Some(device) = device::device() else {
        return;
    };
    let options = options();
    let mut wanted = Request::open(Path::new("statue-1k")).expect("a mesh");
    wanted.size = [32, 24];
    let mut session = Session::new(&options, &device.device, wanted.clone()).expect("a session");
    for fault in ["nowhere.toml", "nowhere.obj", "Cargo.toml"] {
        assert!(session.open(Path::new(fault)).is_err(), "{fault}");
        assert_eq!(session.wanted, wanted, "{fault}");
        assert!(session.motion().is_none());
    }
    session.open(Path::new("betta")).expect("a mesh that moves");
    assert!(session.motion().is_some());
    assert_eq!(session.wanted.size, wanted.size);
    assert!(!session.converged());
}

/// A light that moves is steered from where it is drawn, and another mesh is as large as it is.
#[test]
fn what_the_scene_moves_is_taken_up_where_it_is() {
    let Some(device) = device::device() else {
        return;
    };
    let folder = folder();
    let scene = |text: &str| {
        let path = folder.path().join("scene.toml");
        fs::write(&path, text).expect("a scene");
        let mut wanted = Request::open(&path).expect("a scene");
        wanted.size = [32, 24];
        Session::new(&options(), &device.device, wanted).expect("a session")
    };
    let keyed = "mesh = \"statue-1k\"\nunit = 1000\n[animation]\nduration = 4\nfps = 10\n\
                 [animation.light]\nkeys = [{ time = 0, azimuth = -60, elevation = 10 }, \
                 { time = 2, azimuth = 120, elevation = 60 }]\n";
    let turning =
        "mesh = \"statue-1k\"\n[animation]\nduration = 4\nfps = 10\n[animation.light]\nturns = 1\n";
    for (text, frame, azimuth, elevation) in
        [(keyed, 20, 120.0, Some(60.0)), (turning, 10, 90.0, None)]
    {
        let mut session = scene(text);
        let base = session.wanted.light.clone();
        session.frame_number = frame;
        let light = session.light();
        let motion = session.motion().expect("one");
        let drawn = motion.light(motion.time(frame));
        let wanted = if elevation.is_none() {
            base.azimuth + azimuth
        } else {
            azimuth
        };
        let apart = |a: f64, b: f64| (a - b + 180.0).rem_euclid(360.0) - 180.0;
        assert!(
            apart(light.azimuth, wanted).abs() < 1e-9,
            "{}",
            light.azimuth
        );
        assert!(apart(light.azimuth, drawn.azimuth).abs() < 1e-9);
        assert_eq!(light.elevation, drawn.elevation);
        assert!(elevation.is_none_or(|own| (light.elevation - own).abs() < 1e-9));
        let mut turned = light.clone();
        turned.azimuth = -170.0;
        session.aim(turned.clone());
        assert!(apart(session.light().azimuth, -170.0).abs() < 1e-9);
        assert_eq!(session.light().elevation, light.elevation);
        assert!(session.wanted.animation.light_keys.is_none());
    }
    let mut session = scene(keyed);
    let other = Request::open(Path::new("statue-5k")).expect("a mesh");
    session.wanted.show(&other);
    assert_eq!(session.wanted.unit, 1.0);
    assert_eq!(session.wanted.animation, other.animation);
    assert_eq!(session.wanted.light, scene(keyed).wanted.light);
}

/// What is shown is what `render` draws from the scene that is saved: methods are chosen for all frames of the still.
#[test]
fn a_budget_counts_what_the_still_reads() {
    let Some(device) = device::device() else {
        return;
    };
    let mut wanted = Request::open(Path::new("statue-1k")).expect("a mesh");
    (wanted.size, wanted.fetch_budget) = ([32, 24], Some(16));
    let session = Session::new(&options(), &device.device, wanted).expect("a session");
    let chosen = session.chosen().expect("a choice");
    assert!(session.fetches() <= 16, "{} fetches", session.fetches());
    assert_eq!(session.fetches(), chosen.fetches);
    let saved = session.request().plan().expect("a plan");
    assert_eq!(saved.frames_averaged, session.plan().frames_averaged);
}

#[test]
fn no_display_ends_with_code_3_and_the_remedy() {
    let folder = folder();
    for display in [None, Some(":65432")] {
        let mut program = marmor();
        program.current_dir(folder.path()).arg("view");
        for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            program.env_remove(name);
        }
        program.envs(display.map(|name| ("DISPLAY", name)));
        let output = program.output().expect("the binary runs");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        for fragment in ["no display", "DISPLAY", "marmor render"] {
            assert!(stderr.contains(fragment), "{stderr}");
        }
    }
}

/// Libraries that only a window needs. Drivers of Vulkan bring some of their own, so what counts is who asks.
const WINDOW: [&str; 4] = ["libX", "libxcb", "libxkb", "libwayland"];

#[test]
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn nothing_but_the_window_needs_libraries_of_windows() {
    let folder = folder();
    let asked = |arguments: &[&str]| -> Vec<String> {
        // The loader's own account: who needs a library, and who opens one.
        let output = marmor()
            .current_dir(folder.path())
            .env("LD_DEBUG", "files")
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .args(arguments)
            .output()
            .expect("the binary runs");
        let account = String::from_utf8_lossy(&output.stderr);
        let own = account.lines().filter(|line| {
            let who = line.split_once(" by ").map(|(_, who)| who);
            line.contains("file=") && who.is_some_and(|who| who.contains("/marmor "))
        });
        own.map(|line| line.split_once("file=").unwrap_or_default().1.to_owned())
            .collect()
    };
    let windows = |files: &[String]| -> Vec<String> {
        let of_windows = files
            .iter()
            .filter(|file| WINDOW.iter().any(|name| file.starts_with(name)));
        of_windows.cloned().collect()
    };
    let files = asked(&["--version"]);
    assert!(
        files.iter().any(|file| file.starts_with("libc.so")),
        "{files:?}"
    );
    assert_eq!(windows(&files), Vec::<String>::new());
    if !device::present() {
        return;
    }
    let render = [
        "render",
        "statue-1k",
        "-q",
        "-o",
        "a.png",
        "--size",
        "16x12",
    ];
    let files = asked(&render);
    assert!(folder.path().join("a.png").exists());
    assert!(
        files.iter().any(|file| file.starts_with("libvulkan")),
        "{files:?}"
    );
    assert_eq!(windows(&files), Vec::<String>::new());
}

#[test]
fn screenshots() {
    if !set("MARMOR_UPDATE_SCREENSHOTS") || !device::present() {
        return;
    }
    let Some(display) = Display::open("1280x800x24") else {
        return;
    };
    let folder = folder();
    let folder = folder.path();
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images");
    let shoot = |name: &str| {
        // The panel says so a moment after the picture is whole, and what a fetch costs is found out after that.
        thread::sleep(Duration::from_secs(10));
        let screen = display.capture(folder);
        screen.save(images.join(name)).expect("a screenshot");
    };
    let mixture = ["statue", "--multiple", "mixture", "--window", "1280x800"];
    let mut viewer = Viewer::open(&display, folder, &mixture);
    viewer.whole();
    shoot("view.png");
    viewer.end(|viewer| viewer.key("ctrl+q"));

    let mut split = mixture.to_vec();
    split.extend([
        "--material",
        "skin1",
        "--light",
        "112,28",
        "--split",
        "brdf",
    ]);
    let mut viewer = Viewer::open(&display, folder, &split);
    let [width, _] = viewer.whole();
    let middle = (width / 2) as i32;
    viewer.drag("1", [middle, 300], [middle - 24, 300]);
    viewer.whole();
    // Not with the line lit up under the pointer.
    viewer.xdotool(&["mousemove", "20", "20"]);
    shoot("view-split.png");
    viewer.end(|viewer| viewer.key("ctrl+q"));
}
