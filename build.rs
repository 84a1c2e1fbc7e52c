//! Compiles the shaders to SPIR-V and writes a typed table of them, so that a shader that
//! does not compile, or a name that does not exist, is a build error.
//!
//! Each is compiled twice: as it runs, and as the counting build, in which every read of a texture counts itself
//! (shaders/fetch.glsl); what shades also as its reads alone (shaders/floor.glsl). All keep names and lines, so that the ledger can say where a read stands, and debuggers show
//! the source.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs, process, thread};

/// Every shader of the frame but those that shade: file, variant, and the macros that make the variant.
const SHADERS: &[(&str, &str, &[&str])] = &[
    ("deform.comp", "", &[]),
    ("light.vert", "", &[]),
    ("light.frag", "", &[]),
    ("light.frag", "fourth", &["FOURTH"]),
    ("view.vert", "", &[]),
    ("view.frag", "", &[]),
    ("view.vert", "motion", &["MOTION"]),
    ("view.frag", "motion", &["MOTION"]),
    ("shade.vert", "", &[]),
    ("decimate.comp", "", &[]),
    ("decimate.comp", "fourth", &["FOURTH"]),
    ("smooth.comp", "", &[]),
    ("smooth.comp", "fourth", &["FOURTH"]),
    ("volume.comp", "", &[]),
    ("volume_halve.comp", "", &[]),
    ("volume_blur.comp", "", &[]),
    ("boxes.comp", "", &[]),
    ("boxes_shared.comp", "", &[]),
    ("exact.comp", "", &[]),
    ("probe.frag", "", &[]),
    ("probe.frag", "texel", &["TEXEL"]),
    ("probe.frag", "gather", &["GATHER"]),
    ("probe.frag", "volume", &["VOLUME"]),
    ("probe.frag", "storage", &["STORAGE"]),
    ("probe.frag", "storage scalar", &["STORAGE_SCALAR"]),
    // Scattering comes from the picture of half the size.
    ("shade.frag", "half", &["METHOD_HALF"]),
    ("resolve.frag", "", &[]),
    ("resolve.frag", "encode", &["ENCODE"]),
    // Live display: each frame is joined with a history, and shown.
    ("resolve.frag", "live", &["ENCODE", "LIVE"]),
    (
        "resolve.frag",
        "live nearest",
        &["ENCODE", "LIVE", "NO_LINEAR"],
    ),
    // The window.
    ("compose.frag", "", &[]),
    ("panel.vert", "", &[]),
    ("panel.frag", "", &[]),
];

/// The shaders that shade, by their method for multiple scattering.
const SHADE: &[(&str, &[&str])] = &[
    ("none", &["METHOD_NONE"]),
    ("brdf", &["METHOD_BRDF"]),
    ("samples", &["METHOD_SAMPLES"]),
    ("rings", &["METHOD_RINGS"]),
    ("rings nearest", &["METHOD_RINGS", "NO_LINEAR"]),
    ("mixture", &["METHOD_MIXTURE"]),
    ("mixture nearest", &["METHOD_MIXTURE", "NO_LINEAR"]),
    ("mixture fourth", &["METHOD_MIXTURE", "FOURTH"]),
    (
        "mixture nearest fourth",
        &["METHOD_MIXTURE", "NO_LINEAR", "FOURTH"],
    ),
    ("mixture volumes", &["METHOD_MIXTURE", "VOLUMES"]),
    (
        "mixture fourth volumes",
        &["METHOD_MIXTURE", "FOURTH", "VOLUMES"],
    ),
    (
        "mixture nearest volumes",
        &["METHOD_MIXTURE", "NO_LINEAR", "VOLUMES"],
    ),
    (
        "mixture nearest fourth volumes",
        &["METHOD_MIXTURE", "NO_LINEAR", "FOURTH", "VOLUMES"],
    ),
];

/// Each of them without single scattering, with it, and with it from the depth buffer.
const SINGLE: &[(&str, &[&str])] = &[
    ("", &[]),
    ("single", &["SINGLE"]),
    ("single depth", &["SINGLE", "EXITS_DEPTH"]),
];

/// The builds of a shader, by the macro that makes them.
const BUILDS: [Option<&str>; 3] = [None, Some("COUNTING"), Some("FLOOR")];

/// A copy of a shader with a read that nobody declared, so that tests can see the ledger catch it: the file, where the
/// read goes in, and the read.
const STRAY: (&str, &str, &str) = (
    "shade.frag",
    "    out_radiance = vec4(radiance",
    "    radiance += 1e-6 * texture(moments, vec2(0.5)).rgb;\n",
);

/// Something to compile.
struct Job {
    file: &'static str,
    variant: String,
    macros: Vec<&'static str>,
    stray: bool,
}

fn main() {
    if let Err(message) = run() {
        // One clear block on stderr in place of a backtrace.
        eprintln!("\n{message}\n");
        std::process::exit(1);
    }
}

fn run() -> Result<(), String> {
    let folder = Path::new("shaders");
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=build.rs");
    name_commit();

    let jobs = jobs();
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets no OUT_DIR")?);
    let next = AtomicUsize::new(0);
    let threads = thread::available_parallelism().map_or(1, usize::from);
    // A compiler is not for several threads at once: each has its own.
    let work = || -> Result<(), String> {
        let compiler =
            shaderc::Compiler::new().map_err(|e| format!("shaderc does not start: {e}"))?;
        while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            for build in BUILDS {
                let binary = compile(&compiler, folder, job, build)?;
                write(&out.join(spirv_name(job, build)), &binary)?;
            }
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker
                .join()
                .map_err(|_| "a compiling thread died".to_owned())?
        })
    })?;

    let mut table = String::from("// Written by build.rs.\n");
    for job in &jobs {
        let name = job.name();
        let stage = stage(job.file)?.1;
        let [plain, counting, floor] = BUILDS.map(|build| spirv_name(job, build));
        writeln!(
            table,
            "/// `{name}`\npub const {}: Shader = Shader {{ name: {name:?}, \
             stage: ash::vk::ShaderStageFlags::{stage}, \
             spirv: include_bytes!({plain:?}), counting: include_bytes!({counting:?}), \
             floor: include_bytes!({floor:?}) }};",
            job.constant()
        )
        .map_err(|e| e.to_string())?;
    }
    write(&out.join("shaders.rs"), table.as_bytes())
}

/// Names the commit for `marmor bench`, where this is a clone and git is there.
fn name_commit() {
    // Written whenever another commit is checked out or made. To watch what is not there would build each time anew.
    let log = ".git/logs/HEAD";
    if Path::new(log).exists() {
        println!("cargo:rerun-if-changed={log}");
    }
    let git = process::Command::new("git")
        .args(["describe", "--always", "--dirty"])
        .output();
    if let Some(output) = git.ok().filter(|output| output.status.success()) {
        let commit = String::from_utf8_lossy(&output.stdout);
        println!("cargo:rustc-env=MARMOR_COMMIT={}", commit.trim());
    }
}

/// Every shader of the table.
fn jobs() -> Vec<Job> {
    let shade = SHADE.iter().flat_map(|(method, macros)| {
        SINGLE.iter().map(move |(single, more)| Job {
            file: "shade.frag",
            variant: format!("{method} {single}").trim().to_owned(),
            macros: [*macros, *more].concat(),
            stray: false,
        })
    });
    let others = SHADERS.iter().map(|&(file, variant, macros)| Job {
        file,
        variant: variant.to_owned(),
        macros: macros.to_vec(),
        stray: false,
    });
    let stray = Job {
        file: STRAY.0,
        variant: "stray".to_owned(),
        macros: vec!["METHOD_MIXTURE"],
        stray: true,
    };
    others.chain(shade).chain([stray]).collect()
}

impl Job {
    fn name(&self) -> String {
        format!("{} {}", self.file, self.variant).trim().to_owned()
    }

    fn constant(&self) -> String {
        self.name().replace(['.', ' ', '-'], "_").to_uppercase()
    }
}

fn spirv_name(job: &Job, build: Option<&str>) -> String {
    let suffix = build.map_or(String::new(), |build| format!(".{}", build.to_lowercase()));
    format!("{}{suffix}.spv", job.constant().to_lowercase())
}

fn stage(file: &str) -> Result<(shaderc::ShaderKind, &'static str), String> {
    match Path::new(file).extension().and_then(|e| e.to_str()) {
        Some("vert") => Ok((shaderc::ShaderKind::Vertex, "VERTEX")),
        Some("frag") => Ok((shaderc::ShaderKind::Fragment, "FRAGMENT")),
        Some("comp") => Ok((shaderc::ShaderKind::Compute, "COMPUTE")),
        other => Err(format!("{file}: unknown shader stage {other:?}")),
    }
}

fn compile(
    compiler: &shaderc::Compiler,
    folder: &Path,
    job: &Job,
    build: Option<&str>,
) -> Result<Vec<u8>, String> {
    if build == Some("FLOOR") && job.file != "shade.frag" {
        return Ok(Vec::new());
    }
    let path = folder.join(job.file);
    let mut source = read(&path)?;
    if job.stray {
        let (_, before, text) = STRAY;
        if !source.contains(before) {
            return Err(format!("{}: no line starts {before:?}", path.display()));
        }
        source = source.replacen(before, &format!("{text}{before}"), 1);
    }
    let mut options = shaderc::CompileOptions::new()
        .map_err(|e| format!("shaderc gives no compile options: {e}"))?;
    options.set_target_env(
        shaderc::TargetEnv::Vulkan,
        shaderc::EnvVersion::Vulkan1_3 as u32,
    );
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    options.set_warnings_as_errors();
    options.set_generate_debug_info();
    for name in &job.macros {
        options.add_macro_definition(name, None);
    }
    if let Some(build) = build {
        options.add_macro_definition(build, None);
    }
    options.set_include_callback(|name, _, from, _| {
        let path = folder.join(name);
        let content = fs::read_to_string(&path)
            .map_err(|e| format!("{from} includes {}: {e}", path.display()))?;
        Ok(shaderc::ResolvedInclude {
            resolved_name: name.to_owned(),
            content,
        })
    });
    let compiled = compiler
        .compile_into_spirv(
            &source,
            stage(job.file)?.0,
            job.file,
            "main",
            Some(&options),
        )
        .map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(compiled.as_binary_u8().to_vec())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}
