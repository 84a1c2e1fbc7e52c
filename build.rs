//! Compiles the shaders to SPIR-V and writes a typed table of them, so that a shader that
//! does not compile, or a name that does not exist, is a build error.
//!
//! Each is compiled twice: as it runs, and as the counting build, in which every read of a texture counts itself
//! (shaders/fetch.glsl); what shades also as its reads alone (shaders/floor.glsl). All keep names and lines, so that
//! the ledger can say where a read stands, and debuggers show the source.

#[path = "src/frame/compile.rs"]
mod compile;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs, process, thread};

use compile::{BUILDS, Job, compile, jobs, kind};

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
    println!("cargo:rerun-if-changed=src/frame/compile.rs");
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
                let binary = compile(&compiler, job, build, &|name| read(&folder.join(name)))?;
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
        let stage = stage(job.file)?;
        let [plain, counting, floor] = BUILDS.map(|build| spirv_name(job, build));
        writeln!(
            table,
            "/// `{name}`\npub const {}: Shader = Shader {{ name: {name:?}, \
             stage: ash::vk::ShaderStageFlags::{stage}, \
             build: ShaderBuild::Plain, \
             spirv: include_bytes!({plain:?}), counting: include_bytes!({counting:?}), \
             floor: include_bytes!({floor:?}) }};",
            constant(job)
        )
        .map_err(|e| e.to_string())?;
    }
    let all: Vec<_> = jobs.iter().map(constant).collect();
    let sources = sources(folder)?;
    writeln!(
        table,
        "/// All of them.\npub const ALL: &[Shader] = &[{}];\n\
         /// The files that they were made of: names and text.\npub const SOURCES: &[(&str, &str)] = &[{}];",
        all.join(", "),
        sources.concat()
    )
    .map_err(|e| e.to_string())?;
    write(&out.join("shaders.rs"), table.as_bytes())
}

/// Each file of `folder`, as an entry of a table.
fn sources(folder: &Path) -> Result<Vec<String>, String> {
    let fault = |e: std::io::Error| format!("{}: {e}", folder.display());
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or("cargo sets no folder")?);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if compile::is_shader(&path) {
            names.push(path);
        }
    }
    names.sort();
    let entry = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        format!("({name:?}, include_str!({:?})), ", root.join(path))
    };
    Ok(names.iter().map(entry).collect())
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

/// The name of a shader's constant in the table.
fn constant(job: &Job) -> String {
    job.name().replace(['.', ' ', '-'], "_").to_uppercase()
}

fn spirv_name(job: &Job, build: Option<&str>) -> String {
    let suffix = build.map_or(String::new(), |build| format!(".{}", build.to_lowercase()));
    format!("{}{suffix}.spv", constant(job).to_lowercase())
}

fn stage(file: &str) -> Result<&'static str, String> {
    match kind(file)? {
        shaderc::ShaderKind::Vertex => Ok("VERTEX"),
        shaderc::ShaderKind::Fragment => Ok("FRAGMENT"),
        shaderc::ShaderKind::Compute => Ok("COMPUTE"),
        _ => Err(format!("{file}: no stage of the frame")),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}
