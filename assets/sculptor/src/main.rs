//! Carves the statue and writes it: `sculptor --out DIR [--preview FILE.png]`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sculptor::preview::{self, View};
use sculptor::statue::Statue;
use sculptor::{Piece, carve, obj};

fn main() {
    if let Err(problem) = run() {
        eprintln!("sculptor: {problem}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let mut out: Option<PathBuf> = None;
    let mut picture: Option<PathBuf> = None;
    let mut of = 20_000;
    let mut step = sculptor::STEP;
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments
            .next()
            .ok_or_else(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--out" => out = Some(value.into()),
            "--preview" => picture = Some(value.into()),
            "--of" => of = value.parse()?,
            "--step" => step = value.parse()?,
            _ => return Err(format!("unknown option {flag}").into()),
        }
    }
    if out.is_none() && picture.is_none() {
        return Err(
            "usage: sculptor --out DIR [--preview FILE.png [--of TRIANGLES]] [--step MM]".into(),
        );
    }
    let clock = Instant::now();
    let statue = Statue::new();
    let pieces = carve(&statue, step)?;
    for piece in &pieces {
        report(piece);
    }
    if let Some(folder) = out {
        std::fs::create_dir_all(&folder)?;
        for piece in pieces.iter().filter(|p| p.name.ends_with(".obj")) {
            let comment = format!(
                "The marmor statue, {} triangles, mm, Y up, facing +Z.\n\
                 Made by: cargo run --release -p sculptor -- --out assets\n\
                 Licence: MIT OR Apache-2.0",
                piece.mesh.triangles.len()
            );
            let text = obj::write(&piece.mesh, &piece.normals, &comment);
            std::fs::write(folder.join(&piece.name), text)?;
        }
    }
    if let Some(path) = picture {
        let piece = pieces
            .iter()
            .min_by_key(|p| p.mesh.triangles.len().abs_diff(of))
            .ok_or("nothing carved")?;
        draw(&statue, piece, &path)?;
    }
    println!("{:.1} s", clock.elapsed().as_secs_f32());
    Ok(())
}

fn report(piece: &Piece) {
    println!(
        "{}: {} triangles, {} vertices, genus {}, {:.0} mm3, closed and manifold",
        piece.name,
        piece.mesh.triangles.len(),
        piece.mesh.positions.len(),
        piece.mesh.genus(),
        piece.mesh.volume(),
    );
}

fn draw(statue: &Statue, piece: &Piece, path: &Path) -> std::io::Result<()> {
    let whole = |azimuth: f32, back_lit: bool| View {
        azimuth,
        elevation: 4.0,
        target: glam::Vec3::new(0.0, 41.0, 0.0),
        height: 88.0,
        back_lit,
    };
    let face = |azimuth: f32| View {
        azimuth,
        elevation: 2.0,
        target: statue.face_centre(),
        height: 36.0,
        back_lit: false,
    };
    let views = [
        whole(0.0, false),
        whole(-35.0, false),
        whole(35.0, false),
        whole(-100.0, false),
        whole(180.0, false),
        whole(-30.0, true),
        face(statue.face_azimuth()),
        face(statue.face_azimuth() + 40.0),
        face(statue.face_azimuth() - 90.0),
    ];
    let field = |p| statue.distance(p);
    preview::sheet(&piece.mesh, &piece.normals, &field, &views, 3, 640, path)
}
