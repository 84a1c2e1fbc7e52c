//! Shaders that are compiled while the program runs: the same as at its build, and whatever a folder holds.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use common::device::{TestDevice, device};
use common::shaders::{copy, replace};
use marmor::frame::watch::{Watcher, compiled};
use marmor::frame::{Error, Renderer, Setup, Shaders, shaders};
use marmor::gpu;
use marmor::scene::{Bundled, MeshSource, Method, Plan, Request};

/// Longer than any editor, system and machine under load take together.
const PATIENCE: Duration = Duration::from_secs(5);

fn own() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

fn watch(folder: &Path) -> Watcher {
    Watcher::new(folder, || ()).expect("a watched folder")
}

/// Whether `watcher` sees a change before patience ends.
fn sees_change(watcher: &Watcher) -> bool {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if watcher.changed() {
            return true;
        }
        thread::sleep(Duration::from_millis(10));
    }
    false
}

fn plan() -> Plan {
    let mut request = Request::of_mesh("test".to_owned(), MeshSource::Bundled(Bundled::Statue5k));
    request.size = [96, 72];
    request.light_map = 64;
    request.multiple = Method::Mixture;
    request.plan().expect("a plan")
}

fn draw(renderer: &mut Renderer) -> Vec<[u8; 4]> {
    renderer.render(&mut |_| ()).expect("a picture");
    renderer.display().expect("its pixels")
}

fn renderer(device: &TestDevice, setup: &Setup) -> Result<Renderer, gpu::Error> {
    Renderer::new(&device.device, &plan(), setup)
}

#[test]
fn compiling_at_run_time_gives_what_the_build_gave() {
    // All of them in all builds take a minute. These are every fifth, in turn by each of its builds, from the last one,
    // which is one that shades, as are most.
    let some = shaders::ALL.iter().rev().step_by(5).zip((0..3).cycle());
    let work: Vec<_> = some
        .map(|(shader, build)| [*shader, shader.counted(), shader.floored()][build])
        .collect();
    let (next, seen) = (AtomicUsize::new(0), Mutex::new([0; 3]));
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(shader) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let words = compiled(&own(), shader).expect("a compiled shader");
                    assert!(
                        words == shader.words(),
                        "{} {:?}",
                        shader.name,
                        shader.build
                    );
                    seen.lock().expect("the counts")[shader.build as usize] += 1;
                }
            });
        }
    });
    let seen = seen.into_inner().expect("the counts");
    assert!(seen.iter().all(|&count| count > 1), "{seen:?}");
}

#[test]
fn a_changed_shader_changes_the_picture_until_it_is_restored() {
    let Some(device) = device() else { return };
    let folder = copy();
    let watcher = watch(folder.path());
    let picture = || draw(&mut renderer(&device, &Setup::default()).expect("a renderer"));
    let first = picture();
    device.device.set_shader_source(Some(watcher.source()));
    assert_eq!(first, picture(), "the same texts");

    // The shoulder of the tone curve, and then a file that others include.
    for (file, before, after) in [
        (
            "resolve.frag",
            "value.rgb * frame.z_v.w",
            "value.rgb * 0.5 * frame.z_v.w",
        ),
        ("fresnel.glsl", "return ", "return 0.5 * "),
    ] {
        replace(folder.path(), file, before, after);
        assert!(sees_change(&watcher), "{file}");
        let changed = picture();
        assert_ne!(first, changed, "{file}");
        assert_eq!(changed, picture(), "{file}, as it was compiled before");
        replace(folder.path(), file, after, before);
        assert!(sees_change(&watcher), "{file} restored");
        assert_eq!(first, picture(), "{file} restored");
    }
    device.device.set_shader_source(None);
    assert_eq!(first, picture());
}

#[test]
fn each_build_is_compiled_as_itself() {
    let Some(device) = device() else { return };
    let folder = copy();
    let watcher = watch(folder.path());
    // A line more moves what debuggers see, and nothing that runs.
    for (name, text) in shaders::SOURCES {
        let path = folder.path().join(name);
        fs::write(path, format!("{text}\n// More.\n")).expect("a shader");
    }
    for shaders in [Shaders::Counting, Shaders::Floor, Shaders::Stray] {
        let setup = Setup {
            shaders,
            ..Setup::default()
        };
        let seen = |source| {
            device.device.set_shader_source(source);
            let mut renderer = renderer(&device, &setup).expect("a renderer");
            let picture = draw(&mut renderer);
            let counts = renderer.counts().expect("its counts");
            let reads = counts.into_iter().map(|counts| counts.reads);
            (picture, reads.collect::<Vec<_>>())
        };
        let (own, watched) = (seen(None), seen(Some(watcher.source())));
        assert_eq!(own.1.is_empty(), shaders == Shaders::Floor);
        assert!(own == watched, "{shaders:?}");
    }
}

#[test]
fn an_error_names_file_and_line_and_what_was_made_goes_on() {
    let Some(device) = device() else { return };
    let folder = copy();
    let watcher = watch(folder.path());
    device.device.set_shader_source(Some(watcher.source()));
    let mut before = renderer(&device, &Setup::default()).expect("a renderer");
    let first = draw(&mut before);
    let message = || match renderer(&device, &Setup::default()) {
        Err(gpu::Error::Shader(message)) => {
            assert!(matches!(
                Error::from(gpu::Error::Shader(message.clone())),
                Error::Shader(same) if same == message
            ));
            message
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("no error"),
    };

    let text = fs::read_to_string(folder.path().join("resolve.frag")).expect("a shader");
    let line = text
        .lines()
        .position(|line| line.starts_with("vec3 tone_map"));
    let line = line.expect("the tone curve") + 2;
    replace(
        folder.path(),
        "resolve.frag",
        "return mix(x",
        "return mxi(x",
    );
    let error = message();
    assert!(
        error.contains(&format!("resolve.frag:{line}: error: 'mxi'")),
        "{error}"
    );
    assert_eq!(error, message(), "as it was kept");
    replace(
        folder.path(),
        "resolve.frag",
        "return mxi(x",
        "return mix(x",
    );

    // What the host does not bind is no crash of the driver.
    let bound = "layout(binding = 9) uniform Tint { vec4 tint; };\nvec3 tone_map";
    replace(folder.path(), "resolve.frag", "vec3 tone_map", bound);
    replace(
        folder.path(),
        "resolve.frag",
        "vec3 color = ",
        "vec3 color = tint.rgb + ",
    );
    let error = message();
    assert!(
        error.contains("resolve.frag") && error.contains("binding 9"),
        "{error}"
    );
    fs::write(folder.path().join("resolve.frag"), &text).expect("a shader");

    // Of what is included, its own name and line.
    let path = folder.path().join("specular.glsl");
    let text = fs::read_to_string(&path).expect("a shader");
    fs::write(&path, format!("oops;\n{text}")).expect("a shader");
    let error = message();
    assert!(error.contains("specular.glsl:1: error: "), "{error}");
    fs::remove_file(&path).expect("no shader");
    let error = message();
    assert!(
        error.contains("shade.frag:") && error.contains(&path.display().to_string()),
        "{error}"
    );
    fs::write(&path, [0xff, 0xfe, 0xfd]).expect("no text");
    assert!(message().contains("UTF-8"));
    fs::write(&path, text).expect("a shader");

    fs::remove_file(folder.path().join("light.vert")).expect("no shader");
    let error = message();
    assert!(error.contains("light.vert"), "{error}");
    assert_eq!(first, draw(&mut before), "the renderer of before");
}

#[test]
fn an_unknown_shader_is_an_error() {
    let unknown = gpu::Shader {
        name: "nothing.frag",
        ..shaders::RESOLVE_FRAG
    };
    let error = compiled(&own(), &unknown).expect_err("no such shader");
    assert!(error.contains("nothing.frag"), "{error}");
    let source = watch(&own()).source();
    assert_eq!(source(&unknown), Err(error));
    assert_eq!(source(&shaders::RESOLVE_FRAG), Ok(None));
}

#[test]
fn changes_are_seen_once_and_wake() {
    let folder = copy();
    let wakes = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&wakes);
    let watcher = Watcher::new(folder.path(), move || {
        count.fetch_add(1, Ordering::Relaxed);
    })
    .expect("a watched folder");
    // Reading is no change, nor is what editors leave, nor a text written as it was.
    let source = watcher.source();
    assert_eq!(source(&shaders::RESOLVE_FRAG), Ok(None));
    for name in [".resolve.frag.swp", ".#resolve.frag", "resolve.frag~"] {
        fs::write(folder.path().join(name), "x").expect("a file");
    }
    replace(folder.path(), "resolve.frag", "0.8", "0.8");
    thread::sleep(Duration::from_millis(500));
    assert!(!watcher.changed());
    assert_eq!(wakes.load(Ordering::Relaxed), 0);

    // As editors do: a new file beside, renamed over the old one, which is kept.
    let path = folder.path().join("resolve.frag");
    let text = fs::read_to_string(&path)
        .expect("a shader")
        .replace("0.8", "0.7");
    let beside = folder.path().join("resolve.frag~new");
    fs::write(&beside, &text).expect("a file beside");
    fs::rename(&path, folder.path().join("resolve.frag~")).expect("a kept file");
    fs::rename(&beside, &path).expect("a renamed file");
    assert!(sees_change(&watcher), "write and rename");
    assert!(!watcher.changed(), "once");
    assert!(matches!(source(&shaders::RESOLVE_FRAG), Ok(Some(_))));
    // The flag goes up just before the call.
    thread::sleep(Duration::from_millis(100));
    assert_eq!(wakes.load(Ordering::Relaxed), 1);

    // In place, and after that removed.
    fs::write(&path, text.replace("0.7", "0.6")).expect("a shader");
    assert!(sees_change(&watcher), "written in place");
    fs::remove_file(&path).expect("no shader");
    assert!(sees_change(&watcher), "removed");
    thread::sleep(Duration::from_millis(100));
    assert_eq!(wakes.load(Ordering::Relaxed), 3);
}

#[test]
fn what_is_no_folder_of_shaders_is_refused_in_one_line() {
    let empty = tempfile::tempdir().expect("a folder");
    for folder in [
        empty.path(),
        Path::new("no/such/folder"),
        &own().join("resolve.frag"),
    ] {
        let Err(error) = Watcher::new(folder, || ()) else {
            panic!("{} is watched", folder.display());
        };
        let error = error.to_string();
        assert!(error.contains(&folder.display().to_string()), "{error}");
        assert!(error.contains("name the folder shaders"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
