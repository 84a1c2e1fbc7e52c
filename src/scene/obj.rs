//! Wavefront OBJ.
//!
//! A file is read twice. The first pass checks it line by line, so that every fault has
//! a line number, and copies what geometry needs: `v`, `vt`, `vn` and `f`. Objects,
//! groups, materials, smoothing groups and lines are left behind, which merges the file
//! into one mesh and makes a missing .mtl harmless. The second pass (tobj) resolves
//! indices and cuts polygons into triangles.

use super::{Error, Mesh};
use glam::DVec3;
use std::fmt::Write as _;
use std::path::Path;

/// Loads one mesh, in the file's own unit.
///
/// Normals that the file lacks are computed; triangles without area are dropped.
///
/// # Errors
/// The file cannot be read, is no OBJ, has no faces, refers to vertices that are not
/// there, holds coordinates that are not finite, or has no area at all.
pub fn load(path: &Path) -> Result<Mesh, Error> {
    let place = path.display();
    let bytes = super::bytes::read(path)?;
    parse(&bytes, &place.to_string())
}

/// Parses the bytes of an OBJ; `name` stands for the file in messages.
///
/// # Errors
/// As [`load`], less what concerns the file system.
pub fn parse(bytes: &[u8], name: &str) -> Result<Mesh, Error> {
    let text = super::bytes::utf8(bytes, name)?;
    let geometry = geometry(text, name)?;
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let (models, _) = tobj::load_obj_buf(&mut geometry.as_bytes(), &options, |_| {
        Ok(Default::default())
    })
    .map_err(|fault| Error::of(name, format!("not a usable OBJ ({fault}); export it anew")))?;

    let mut mesh = Mesh::default();
    for model in &models {
        append(&mut mesh, &model.mesh, name)?;
    }
    let dropped = mesh.drop_degenerate();
    if dropped > 0 {
        tracing::debug!("{name}: {dropped} triangles without area dropped");
    }
    if mesh.triangles.is_empty() {
        return Err(Error::of(
            name,
            "no triangle has any area (all vertices lie on a point or a line); \
             check the scale of the export",
        ));
    }
    mesh.complete_normals();
    tracing::info!(
        "{name}: {} vertices, {} triangles",
        mesh.positions.len(),
        mesh.triangles.len()
    );
    Ok(mesh)
}

fn append(mesh: &mut Mesh, part: &tobj::Mesh, name: &str) -> Result<(), Error> {
    let vertices = part.positions.len() / 3;
    let base = u32::try_from(mesh.positions.len())
        .ok()
        .filter(|base| u64::from(*base) + vertices as u64 <= u64::from(u32::MAX))
        .ok_or_else(|| Error::of(name, "more than 4294967295 vertices; decimate the mesh"))?;
    let point = |c: &[f32]| match *c {
        [x, y, z] => DVec3::new(x.into(), y.into(), z.into()),
        _ => DVec3::ZERO,
    };
    mesh.positions
        .extend(part.positions.chunks_exact(3).map(point));
    // Where only some corners of a file have a normal or a texture coordinate, tobj's
    // lists are shorter than the vertices and cannot be matched to them.
    if part.normals.len() == 3 * vertices {
        mesh.normals.extend(part.normals.chunks_exact(3).map(point));
    } else if !part.normals.is_empty() {
        tracing::debug!("{name}: normals on some corners only; computing all of them");
    }
    mesh.normals.resize(mesh.positions.len(), DVec3::ZERO);
    if part.texcoords.len() == 2 * vertices {
        let pairs = part.texcoords.chunks_exact(2);
        mesh.uvs.extend(pairs.map(|c| [c[0], c[1]]));
    } else if !part.texcoords.is_empty() {
        tracing::debug!("{name}: texture coordinates on some corners only; ignored");
    }
    mesh.uvs.resize(mesh.positions.len(), [0.0; 2]);
    let triangles = part.indices.chunks_exact(3);
    mesh.triangles
        .extend(triangles.map(|c| [base + c[0], base + c[1], base + c[2]]));
    Ok(())
}

/// What a face may refer to, in the order of `v/vt/vn`.
const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The first pass: checks every line and copies what geometry needs.
fn geometry(text: &str, name: &str) -> Result<String, Error> {
    let mut out = String::with_capacity(text.len());
    // How many of each kind were defined, and the highest index that a face used with its
    // line: an index may point forwards, so it is checked when all are known.
    let mut defined = [0i64; 3];
    let mut highest = [(0i64, 0usize); 3];
    let mut faces = 0usize;
    for (line, content) in logical_lines(text) {
        let content = content.split('#').next().unwrap_or_default();
        let mut words = content.split_whitespace();
        let fault = |problem: String| Error::at(name, line, problem);
        match words.next() {
            Some("v") => {
                defined[0] += 1;
                let values = numbers(words, line, name)?;
                let weight = match values[..] {
                    [_, _, _, w] if w != 0.0 => w,
                    _ => 1.0,
                };
                let finite = |v: &f32| (v / weight).is_finite();
                if !values.iter().take(3).all(finite) {
                    return Err(fault(format!(
                        "vertex {} is not finite ({}); repair the mesh or export it anew",
                        defined[0],
                        content.trim()
                    )));
                }
                match values[..] {
                    [x, y, z] => write_line(&mut out, "v", &[x, y, z]),
                    [_, _, _, 0.0] => {
                        return Err(fault(format!(
                            "vertex {} has weight w = 0, a point at infinity; write x y z",
                            defined[0]
                        )));
                    }
                    [x, y, z, w] => write_line(&mut out, "v", &[x / w, y / w, z / w]),
                    // Beyond six come colours, which scattering has no use for.
                    [x, y, z, _, _, _, ..] => write_line(&mut out, "v", &[x, y, z]),
                    _ => {
                        return Err(fault(format!(
                            "vertex {} has {} numbers; write x y z",
                            defined[0],
                            values.len()
                        )));
                    }
                }
            }
            Some("vt") => {
                defined[1] += 1;
                let values = numbers(words, line, name)?;
                let u = values.first().copied().unwrap_or(0.0);
                let v = values.get(1).copied().unwrap_or(0.0);
                let [u, v] = [u, v].map(|x| if x.is_finite() { x } else { 0.0 });
                write_line(&mut out, "vt", &[u, v]);
            }
            Some("vn") => {
                defined[2] += 1;
                match numbers(words, line, name)?[..] {
                    [x, y, z] if [x, y, z].iter().all(|v| v.is_finite()) => {
                        write_line(&mut out, "vn", &[x, y, z]);
                    }
                    // A zero normal is computed from the faces later.
                    [_, _, _] => write_line(&mut out, "vn", &[0.0; 3]),
                    ref other => {
                        return Err(fault(format!(
                            "normal {} has {} numbers; write x y z",
                            defined[2],
                            other.len()
                        )));
                    }
                }
            }
            Some("f") => {
                faces += 1;
                let mut corners = 0;
                out.push('f');
                for word in words {
                    corners += 1;
                    let resolved = corner(word, defined).map_err(&fault)?;
                    for (kind, index) in resolved.into_iter().enumerate() {
                        if let (Some(index), Some(highest)) = (index, highest.get_mut(kind))
                            && index > highest.0
                        {
                            *highest = (index, line);
                        }
                    }
                    write_corner(&mut out, resolved);
                }
                out.push('\n');
                if corners < 3 {
                    return Err(fault(format!(
                        "a face with {corners} corners; a face needs at least 3"
                    )));
                }
            }
            _ => {}
        }
    }
    for ((kind, count), (index, line)) in KINDS.iter().zip(defined).zip(highest) {
        if index > count {
            return Err(Error::at(
                name,
                line,
                format!(
                    "a face refers to {kind} {index}, but the file has {count}; \
                     the file is cut short or was edited, export it anew"
                ),
            ));
        }
    }
    if faces == 0 {
        let what = match defined[0] {
            0 => "neither vertices nor faces",
            _ => "vertices but no faces",
        };
        return Err(Error::of(
            name,
            format!("the OBJ has {what}; export the mesh with its faces"),
        ));
    }
    Ok(out)
}

/// Lines with their numbers (from 1), those that end in a backslash joined to the next.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, first) = lines.next()?;
        let Some(start) = first.strip_suffix('\\') else {
            return Some((index + 1, first.into()));
        };
        let mut joined = start.to_owned();
        for (_, next) in lines.by_ref() {
            joined.push(' ');
            match next.strip_suffix('\\') {
                Some(part) => joined.push_str(part),
                None => {
                    joined.push_str(next);
                    break;
                }
            }
        }
        Some((index + 1, joined.into()))
    })
}

fn numbers<'a>(
    words: impl Iterator<Item = &'a str>,
    line: usize,
    name: &str,
) -> Result<Vec<f32>, Error> {
    words
        .map(|word| {
            word.parse::<f32>().map_err(|_| {
                Error::at(
                    name,
                    line,
                    format!("\"{word}\" is not a number; export the mesh anew"),
                )
            })
        })
        .collect()
}

/// Resolves one corner of a face, `v`, `v/vt`, `v//vn` or `v/vt/vn`, to indices counted
/// from 1. Negative indices count back from the latest definition.
fn corner(word: &str, defined: [i64; 3]) -> Result<[Option<i64>; 3], String> {
    let malformed =
        || format!("\"{word}\" is no corner of a face; write v, v/vt, v//vn or v/vt/vn");
    let mut resolved = [None; 3];
    for (kind, part) in word.split('/').enumerate() {
        let (Some(slot), Some(&count), Some(what)) =
            (resolved.get_mut(kind), defined.get(kind), KINDS.get(kind))
        else {
            return Err(malformed());
        };
        if part.is_empty() && kind > 0 {
            continue;
        }
        let index: i64 = part.parse().map_err(|_| malformed())?;
        *slot = Some(match index {
            1.. => index,
            0 => return Err(format!("a face refers to {what} 0; OBJ counts from 1")),
            _ if count.saturating_add(index) < 0 => {
                return Err(format!(
                    "a face refers to {what} {index}, but only {count} come before it; \
                     export the mesh anew"
                ));
            }
            _ => count + index + 1,
        });
    }
    Ok(resolved)
}

fn write_line(out: &mut String, keyword: &str, values: &[f32]) {
    out.push_str(keyword);
    for value in values {
        // Writing to a String cannot fail; the shortest form reads back exactly.
        let _ = write!(out, " {value}");
    }
    out.push('\n');
}

fn write_corner(out: &mut String, [v, vt, vn]: [Option<i64>; 3]) {
    let _ = write!(out, " {}", v.unwrap_or_default());
    if vt.is_some() || vn.is_some() {
        out.push('/');
    }
    if let Some(vt) = vt {
        let _ = write!(out, "{vt}");
    }
    if let Some(vn) = vn {
        let _ = write!(out, "/{vn}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    fn ok(text: &str) -> Mesh {
        parse(text.as_bytes(), "t.obj").expect("a good OBJ")
    }

    fn fault(text: &str) -> String {
        parse(text.as_bytes(), "t.obj")
            .expect_err("a bad OBJ")
            .to_string()
    }

    #[test]
    fn polygons_are_cut_and_negative_indices_resolved() {
        let quad = ok("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n");
        assert_eq!(quad.triangles.len(), 2);
        assert_eq!(quad.positions.len(), 4);
        assert!(quad.normals.iter().all(|n| *n == DVec3::Z));
    }

    #[test]
    fn objects_merge_and_materials_are_ignored() {
        let text = format!(
            "\u{feff}mtllib nowhere.mtl\no a\n{TRIANGLE}usemtl\nf 1 2 3\no b\ng\ns off\nl 1 2\nl\n\
             v 0 0 1\nf 1 \\\n 2 4 # seen from below\n"
        );
        let mesh = ok(&text);
        assert_eq!(mesh.triangles.len(), 2);
    }

    #[test]
    fn partial_normals_are_replaced_by_computed_ones() {
        let mesh = ok(&format!("{TRIANGLE}vn 1 0 0\nvt 0.5\nf 1//1 2/1 3\n"));
        assert_eq!(mesh.normals, [DVec3::Z; 3]);
        assert_eq!(mesh.uvs, [[0.0; 2]; 3]);
    }

    #[test]
    fn colours_and_weights_are_understood() {
        let mesh = ok("v 0 0 0 1 0 0\nv 2 0 0 2\nv 0 1 0 1 1 1\nf 1 2 3\n");
        assert!(mesh.positions.contains(&DVec3::X));
    }

    #[test]
    fn faults_name_their_line() {
        for (text, fragments) in [
            ("".to_owned(), ["t.obj: ", "neither vertices nor faces"]),
            (TRIANGLE.to_owned(), ["t.obj: ", "no faces"]),
            (
                format!("{TRIANGLE}f 1 2 9\n"),
                ["t.obj:4: ", "vertex 9, but the file has 3"],
            ),
            (
                format!("{TRIANGLE}f 1 2 3/7\n"),
                ["t.obj:4: ", "texture coordinate 7"],
            ),
            (format!("{TRIANGLE}f 1 2 -4\n"), ["t.obj:4: ", "vertex -4"]),
            (
                format!("{TRIANGLE}f 1 2 -9223372036854775808\n"),
                ["t.obj:4: ", "only 3"],
            ),
            (
                format!("{TRIANGLE}f 0 1 2\n"),
                ["t.obj:4: ", "counts from 1"],
            ),
            (format!("{TRIANGLE}f 1 2\n"), ["t.obj:4: ", "at least 3"]),
            (format!("{TRIANGLE}f\n"), ["t.obj:4: ", "at least 3"]),
            (format!("{TRIANGLE}f 1 2 x\n"), ["t.obj:4: ", "\"x\""]),
            (format!("{TRIANGLE}f 1 2 /3\n"), ["t.obj:4: ", "\"/3\""]),
            (
                format!("{TRIANGLE}f 1 2 1/1/1/1\n"),
                ["t.obj:4: ", "corner"],
            ),
            (
                "v 0 0 0\nv nan 0 0\n".to_owned(),
                ["t.obj:2: ", "vertex 2 is not finite"],
            ),
            (
                "v 0 0 1e38 1e-9\n".to_owned(),
                ["t.obj:1: ", "vertex 1 is not finite"],
            ),
            ("v 0 zero 0\n".to_owned(), ["t.obj:1: ", "\"zero\""]),
            ("v 0 0\n".to_owned(), ["t.obj:1: ", "2 numbers"]),
            ("v 0 0 0 0\n".to_owned(), ["t.obj:1: ", "w = 0"]),
            ("vn 0 0\n".to_owned(), ["t.obj:1: ", "2 numbers"]),
            (
                "v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\nf 1 1 2\n".to_owned(),
                ["t.obj: ", "no triangle has any area"],
            ),
        ] {
            let message = fault(&text);
            for fragment in fragments {
                assert!(message.contains(fragment), "{text:?}: {message}");
            }
            assert_eq!(message.lines().count(), 1, "{message}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_named_by_line() {
        let message = parse(b"v 0 0 0\nv \xff 0 0\n", "t.obj")
            .expect_err("not UTF-8")
            .to_string();
        assert!(message.starts_with("t.obj:2: "), "{message}");
    }
}
