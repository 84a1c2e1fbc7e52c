//! Rasterisation of triangles in clip space by Vulkan's rules.
//!
//! Differs from hardware in one point: vertices are not snapped to a sub-pixel grid.

use glam::{DVec2, DVec4};
use rayon::prelude::*;

/// Rows that one task covers.
const BAND: usize = 16;

/// Which triangles are left out. Front faces are counter-clockwise as seen in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cull {
    /// None.
    None,
    /// The front faces.
    Front,
    /// The back faces.
    Back,
}

/// What a pixel sees of the nearest triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Index of the triangle.
    pub triangle: usize,
    /// Depth-buffer value in [0, 1).
    pub depth: f64,
    /// Perspective-correct barycentric coordinates of the pixel centre; they sum to 1.
    pub barycentrics: [f64; 3],
    /// Whether the triangle is counter-clockwise in the picture.
    pub front_facing: bool,
}

/// The nearest fragment of each pixel of a `width` x `height` picture, row-major.
///
/// `clip` holds vertices in Vulkan's clip space (x right, y down, 0 <= z <= w inside),
/// `triangles` indices into it; both must agree, or this panics. Rules: pixel centres at
/// half-integers, top-left rule on shared edges, clipping to the depth range, depth test LESS
/// against a buffer cleared to 1. Of fragments at equal depth the first triangle's stays,
/// however the work is spread over threads.
pub fn rasterise(
    clip: &[DVec4],
    triangles: &[[u32; 3]],
    width: usize,
    height: usize,
    cull: Cull,
) -> Vec<Option<Fragment>> {
    let size = DVec2::new(width as f64, height as f64);
    let pieces: Vec<Piece> = triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, corners)| {
            let corners = corners.map(|i| clip[i as usize]);
            pieces(index, corners, size, cull)
        })
        .collect();

    let mut picture = vec![None; width * height];
    if width == 0 {
        return picture;
    }
    picture
        .par_chunks_mut(width * BAND)
        .enumerate()
        .for_each(|(band, pixels)| {
            let first_row = band * BAND;
            for piece in &pieces {
                piece.fill(pixels, first_row, width);
            }
        });
    picture
}

/// A corner of a triangle, or of a piece that clipping left of it.
#[derive(Clone, Copy)]
struct Corner {
    clip: DVec4,
    /// Coordinates in the unclipped triangle.
    barycentrics: [f64; 3],
}

impl Corner {
    fn lerp(self, other: Corner, t: f64) -> Corner {
        Corner {
            clip: self.clip.lerp(other.clip, t),
            barycentrics: std::array::from_fn(|k| {
                self.barycentrics[k] + t * (other.barycentrics[k] - self.barycentrics[k])
            }),
        }
    }
}

/// Clips one triangle to the depth range and sets up the fan that remains.
fn pieces(index: usize, corners: [DVec4; 3], size: DVec2, cull: Cull) -> Vec<Piece> {
    let mut polygon: Vec<Corner> = (0..3)
        .map(|k| {
            let mut barycentrics = [0.0; 3];
            barycentrics[k] = 1.0;
            Corner {
                clip: corners[k],
                barycentrics,
            }
        })
        .collect();
    // Behind the near plane w may be 0 or negative, so z >= 0 comes first.
    for inside in [|c: DVec4| c.z, |c: DVec4| c.w - c.z] {
        polygon = clipped(&polygon, inside);
    }
    (2..polygon.len())
        .filter_map(|k| Piece::new(index, [polygon[0], polygon[k - 1], polygon[k]], size, cull))
        .collect()
}

/// The part of a convex polygon on which the linear function `inside` is not negative
/// (Sutherland and Hodgman 1974).
fn clipped(polygon: &[Corner], inside: impl Fn(DVec4) -> f64) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let (in_a, in_b) = (inside(a.clip), inside(b.clip));
        if in_a >= 0.0 {
            kept.push(a);
        }
        if (in_a >= 0.0) != (in_b >= 0.0) {
            kept.push(a.lerp(b, in_a / (in_a - in_b)));
        }
    }
    kept
}

/// A triangle in the picture, clockwise as seen, ready to be filled.
struct Piece {
    index: usize,
    front_facing: bool,
    corners: [Corner; 3],
    /// Corners in pixels.
    xy: [DVec2; 3],
    /// Half-open range of rows and of columns whose pixel centres it can cover.
    rows: [usize; 2],
    columns: [usize; 2],
}

impl Piece {
    /// None if it is culled, covers no area or lies outside the picture.
    fn new(index: usize, corners: [Corner; 3], size: DVec2, cull: Cull) -> Option<Piece> {
        let on_screen = |c: &Corner| (c.clip.truncate().truncate() / c.clip.w + 1.0) * 0.5 * size;
        let mut corners = corners;
        let mut xy = [
            on_screen(&corners[0]),
            on_screen(&corners[1]),
            on_screen(&corners[2]),
        ];
        // With y down, a positive cross product means clockwise as seen.
        let area = (xy[1] - xy[0]).perp_dot(xy[2] - xy[0]);
        let front_facing = area < 0.0;
        let culled = match cull {
            Cull::None => false,
            Cull::Front => front_facing,
            Cull::Back => !front_facing,
        };
        // An area of NaN is refused as well: a corner may have w = 0.
        if culled || area == 0.0 || !area.is_finite() {
            return None;
        }
        if front_facing {
            corners.swap(1, 2);
            xy.swap(1, 2);
        }
        let lo = xy[0].min(xy[1]).min(xy[2]);
        let hi = xy[0].max(xy[1]).max(xy[2]);
        // Pixel i has its centre at i + 1/2: those in [lo, hi] start at ceil(lo - 1/2). The
        // casts saturate.
        let range = |lo: f64, hi: f64, size: f64| {
            let first = (lo - 0.5).ceil().max(0.0) as usize;
            let end = (hi + 0.5).floor().min(size).max(0.0) as usize;
            [first, end]
        };
        let columns = range(lo.x, hi.x, size.x);
        let rows = range(lo.y, hi.y, size.y);
        let visible = columns[0] < columns[1] && rows[0] < rows[1];
        visible.then_some(Piece {
            index,
            front_facing,
            corners,
            xy,
            rows,
            columns,
        })
    }

    /// Draws into the rows of `pixels`, the first of which is row `first_row` of the picture.
    fn fill(&self, pixels: &mut [Option<Fragment>], first_row: usize, width: usize) {
        let end_row = first_row + pixels.len() / width;
        for y in self.rows[0].max(first_row)..self.rows[1].min(end_row) {
            let row = &mut pixels[(y - first_row) * width..][..width];
            for (x, pixel) in row
                .iter_mut()
                .enumerate()
                .take(self.columns[1])
                .skip(self.columns[0])
            {
                let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                if let Some(fragment) = self.fragment(centre)
                    && fragment.depth < pixel.map_or(1.0, |f| f.depth)
                {
                    *pixel = Some(fragment);
                }
            }
        }
    }

    /// The fragment at a pixel centre, if the piece covers it.
    fn fragment(&self, centre: DVec2) -> Option<Fragment> {
        let mut weight = [0.0; 3];
        for (k, weight) in weight.iter_mut().enumerate() {
            let (a, b) = (self.xy[(k + 1) % 3], self.xy[(k + 2) % 3]);
            let side = side(a, b, centre);
            if side < 0.0 || (side == 0.0 && !is_top_left(a, b)) {
                return None;
            }
            *weight = side;
        }
        let sum = weight[0] + weight[1] + weight[2];
        let linear = weight.map(|e| e / sum);
        // Depth is linear in the picture; attributes are linear after division by w.
        let blend = |f: &dyn Fn(&Corner) -> f64| -> f64 {
            (0..3).map(|k| linear[k] * f(&self.corners[k])).sum()
        };
        // By differences, so that a triangle of constant depth keeps it exactly and ties stay
        // ties.
        let [z0, z1, z2] = self.corners.map(|c| c.clip.z / c.clip.w);
        let depth = z0 + linear[1] * (z1 - z0) + linear[2] * (z2 - z0);
        let inverse_w = blend(&|c| 1.0 / c.clip.w);
        let barycentrics =
            std::array::from_fn(|i| blend(&|c| c.barycentrics[i] / c.clip.w) / inverse_w);
        Some(Fragment {
            triangle: self.index,
            depth,
            barycentrics,
            front_facing: self.front_facing,
        })
    }
}

/// Twice the area of (a, b, p): positive where p lies inside the edge of a clockwise triangle.
///
/// The end points are put in order first, so that two triangles that share the edge get exactly
/// opposite values and no pixel is covered twice or missed.
fn side(a: DVec2, b: DVec2, p: DVec2) -> f64 {
    if (a.x, a.y) <= (b.x, b.y) {
        (b - a).perp_dot(p - a)
    } else {
        -(a - b).perp_dot(p - b)
    }
}

/// Whether the edge of a clockwise triangle (y down) is its left or its horizontal top one.
fn is_top_left(a: DVec2, b: DVec2) -> bool {
    b.y < a.y || (b.y == a.y && b.x > a.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices of an 8 x 8 picture, given in pixels, at depth `z` with w = 1.
    fn pixels(xy: &[(f64, f64)], z: f64) -> Vec<DVec4> {
        xy.iter()
            .map(|&(x, y)| DVec4::new(x / 4.0 - 1.0, y / 4.0 - 1.0, z, 1.0))
            .collect()
    }

    fn covered(picture: &[Option<Fragment>]) -> usize {
        picture.iter().flatten().count()
    }

    #[test]
    fn shared_edges_belong_to_one_triangle() {
        // A fan around a pixel centre, with edges through many others: each pixel is covered by
        // exactly one.
        let clip = pixels(
            &[(0.5, 0.5), (7.5, 0.5), (7.5, 7.5), (0.5, 7.5), (3.5, 3.5)],
            0.5,
        );
        let fan = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let mut count = [0; 64];
        for triangle in fan {
            for (pixel, fragment) in rasterise(&clip, &[triangle], 8, 8, Cull::None)
                .iter()
                .enumerate()
            {
                count[pixel] += usize::from(fragment.is_some());
            }
        }
        // Top and left edges are in, bottom and right ones out: 7 x 7 pixels.
        for (pixel, count) in count.iter().enumerate() {
            assert_eq!(
                *count,
                usize::from(pixel % 8 < 7 && pixel / 8 < 7),
                "{pixel}"
            );
        }
    }

    #[test]
    fn facing_and_culling_agree() {
        // Counter-clockwise as seen: down the left side first.
        let clip = pixels(&[(0.0, 0.0), (0.0, 8.0), (8.0, 0.0)], 0.5);
        let triangle = [[0, 1, 2]];
        let seen = rasterise(&clip, &triangle, 8, 8, Cull::Back);
        assert!(covered(&seen) > 0 && seen.iter().flatten().all(|f| f.front_facing));
        assert_eq!(covered(&rasterise(&clip, &triangle, 8, 8, Cull::Front)), 0);
        let turned = rasterise(&clip, &[[0, 2, 1]], 8, 8, Cull::Front);
        assert!(turned.iter().flatten().all(|f| !f.front_facing));
        assert_eq!(covered(&turned), covered(&seen));
    }

    #[test]
    fn nearest_wins_and_ties_go_to_the_first() {
        let corners = [(0.0, 0.0), (0.0, 20.0), (20.0, 0.0)];
        let mut clip = pixels(&corners, 0.6);
        clip.extend(pixels(&corners, 0.4));
        clip.extend(pixels(&corners, 0.4));
        let picture = rasterise(&clip, &[[0, 1, 2], [3, 4, 5], [6, 7, 8]], 8, 8, Cull::None);
        assert!(picture.iter().all(|f| f.is_some_and(|f| f.triangle == 1)));
        // LESS against the cleared depth: what lies on the far plane is not drawn.
        assert_eq!(
            covered(&rasterise(
                &pixels(&corners, 1.0),
                &[[0, 1, 2]],
                8,
                8,
                Cull::None
            )),
            0
        );
    }

    #[test]
    fn barycentrics_are_perspective_correct() {
        // Clip position is linear in the corners, so the coordinates must give the pixel back.
        let clip = [
            DVec4::new(-1.0, -1.0, 0.2, 1.0),
            DVec4::new(-3.0, 4.0, 1.0, 3.0),
            DVec4::new(9.0, -5.0, 3.0, 6.0),
        ];
        for (i, fragment) in rasterise(&clip, &[[0, 1, 2]], 8, 8, Cull::None)
            .iter()
            .enumerate()
        {
            let Some(f) = fragment else { continue };
            let p: DVec4 = (0..3).map(|k| clip[k] * f.barycentrics[k]).sum();
            let (x, y) = ((i % 8) as f64 + 0.5, (i / 8) as f64 + 0.5);
            assert!(((p.x / p.w + 1.0) * 4.0 - x).abs() < 1e-12);
            assert!(((p.y / p.w + 1.0) * 4.0 - y).abs() < 1e-12);
            assert!((p.z / p.w - f.depth).abs() < 1e-12);
            assert!((f.barycentrics.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn triangles_behind_the_viewer_are_clipped_away() {
        // One corner behind the near plane, where w is negative: what is left reaches beyond
        // the picture.
        let clip = [
            DVec4::new(0.0, -0.5, 0.5, 1.0),
            DVec4::new(0.5, 0.5, 0.5, 1.0),
            DVec4::new(0.0, 0.0, -1.5, -1.0),
        ];
        let picture = rasterise(&clip, &[[0, 1, 2]], 8, 8, Cull::None);
        assert!(covered(&picture) > 0);
        for f in picture.iter().flatten() {
            assert!((0.0..1.0).contains(&f.depth));
            assert!(
                f.barycentrics
                    .iter()
                    .all(|b| (-1e-12..=1.0 + 1e-12).contains(b))
            );
        }
        let behind = clip.map(|c| DVec4::new(c.x, c.y, -0.1, c.w));
        assert_eq!(
            covered(&rasterise(&behind, &[[0, 1, 2]], 8, 8, Cull::None)),
            0
        );
    }

    #[test]
    fn degenerate_input_draws_nothing() {
        let line = pixels(&[(0.0, 0.0), (4.0, 4.0), (8.0, 8.0)], 0.5);
        assert_eq!(
            covered(&rasterise(&line, &[[0, 1, 2]], 8, 8, Cull::None)),
            0
        );
        let zero = [DVec4::ZERO; 3];
        assert_eq!(
            covered(&rasterise(&zero, &[[0, 1, 2]], 8, 8, Cull::None)),
            0
        );
        assert!(rasterise(&line, &[[0, 1, 2]], 0, 0, Cull::None).is_empty());
    }
}
