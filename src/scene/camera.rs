//! The pinhole camera.

use glam::{DMat4, DVec2, DVec3};

/// A pinhole camera that looks at `target`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Position, mm.
    pub eye: DVec3,
    /// The point at the middle of the picture, mm.
    pub target: DVec3,
    /// Direction that is up in the picture.
    pub up: DVec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub fov: f64,
}

/// A camera bound to a picture size and a depth range: everything the view and
/// shade passes need to go from pixels to positions and back.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Camera position, mm.
    pub eye: DVec3,
    /// Ray through pixel coordinates (x, y), whose component along the optical axis
    /// is 1: ray(x, y) = ray_0 + x ray_x + y ray_y. Pixel centres are at half-integers.
    pub ray_0: DVec3,
    /// Change of the ray by one pixel to the right.
    pub ray_x: DVec3,
    /// Change of the ray by one pixel down.
    pub ray_y: DVec3,
    /// Distance of the near plane along the optical axis, mm.
    pub near: f64,
    /// Distance of the far plane along the optical axis, mm.
    pub far: f64,
    /// Scene to Vulkan clip space (y down, depth 0 at near, 1 at far).
    pub view_proj: DMat4,
}

impl View {
    /// The same view of a picture of `size` pixels in half as many columns and rows, rounded up, and how many these
    /// are. Pixel (i, j) of it has its centre where four pixels meet, at (2 i + 1, 2 j + 1).
    pub fn halved(&self, size: [u32; 2]) -> (View, [u32; 2]) {
        let half = size.map(|side| side.div_ceil(2));
        // Of an odd side the last half pixel reaches a pixel beyond the picture, and the clip space with it: there
        // x' + w = s (x + w).
        let [x, y] = [0, 1].map(|i| f64::from(size[i]) / f64::from(2 * half[i]));
        let wider = DMat4::from_cols_array(&[
            x,
            0.0,
            0.0,
            0.0, //
            0.0,
            y,
            0.0,
            0.0, //
            0.0,
            0.0,
            1.0,
            0.0, //
            x - 1.0,
            y - 1.0,
            0.0,
            1.0,
        ]);
        let view = View {
            ray_x: 2.0 * self.ray_x,
            ray_y: 2.0 * self.ray_y,
            view_proj: wider * self.view_proj,
            ..self.clone()
        };
        (view, half)
    }
}

impl View {
    /// What this view of a picture of `size` pixels shows in columns and rows `part` (x, y, width, height) of it, as a picture
    /// of its own: pixel (i, j) has the ray, and the depth, of pixel (x + i, y + j).
    #[must_use]
    pub fn cropped(&self, size: [u32; 2], part: [u32; 4]) -> View {
        let [x, y, width, height] = part.map(f64::from);
        // Pixels are linear in clip space: x_part + w = (W / width) (x + w) - 2 (x0 / width) w.
        let along = |whole: u32, first: f64, side: f64| {
            let scale = f64::from(whole) / side;
            (scale, scale - 2.0 * first / side - 1.0)
        };
        let (scale_x, shift_x) = along(size[0], x, width);
        let (scale_y, shift_y) = along(size[1], y, height);
        let nearer = DMat4::from_cols_array(&[
            scale_x, 0.0, 0.0, 0.0, //
            0.0, scale_y, 0.0, 0.0, //
            0.0, 0.0, 1.0, 0.0, //
            shift_x, shift_y, 0.0, 1.0,
        ]);
        View {
            ray_0: self.ray_0 + self.ray_x * x + self.ray_y * y,
            view_proj: nearer * self.view_proj,
            ..self.clone()
        }
    }
}

impl Camera {
    /// Binds the camera to `width` x `height` pixels and to the depth range of a
    /// bounding sphere. `jitter` shifts the picture by a fraction of a pixel, in [-1/2, 1/2]^2.
    pub fn view(&self, width: u32, height: u32, center: DVec3, radius: f64, jitter: DVec2) -> View {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let down = forward.cross(right);
        let along = (center - self.eye).dot(forward);
        // A margin, so that nothing of the sphere touches the planes.
        let near = (along - 1.01 * radius).max(1e-3 * radius);
        let far = (along + 1.01 * radius).max(2.0 * near);
        let (w, h) = (f64::from(width), f64::from(height));
        let pixel = 2.0 * (0.5 * self.fov.to_radians()).tan() / h;
        let ray_x = right * pixel;
        let ray_y = down * pixel;
        let ray_0 = forward - ray_x * (0.5 * w - jitter.x) - ray_y * (0.5 * h - jitter.y);

        // Clip coordinates are linear in the camera coordinates (r, d, z) of the point;
        // pixel (x, y) solves r/z = (x - w/2 + jitter.x) pixel, likewise for y.
        let e = DVec3::new(
            right.dot(self.eye),
            down.dot(self.eye),
            forward.dot(self.eye),
        );
        let to_camera = DMat4::from_cols_array(&[
            right.x, down.x, forward.x, 0.0, //
            right.y, down.y, forward.y, 0.0, //
            right.z, down.z, forward.z, 0.0, //
            -e.x, -e.y, -e.z, 1.0,
        ]);
        let depth = far / (far - near);
        let projection = DMat4::from_cols_array(&[
            2.0 / (pixel * w),
            0.0,
            0.0,
            0.0, //
            0.0,
            2.0 / (pixel * h),
            0.0,
            0.0, //
            -2.0 * jitter.x / w,
            -2.0 * jitter.y / h,
            depth,
            1.0, //
            0.0,
            0.0,
            -near * depth,
            0.0,
        ]);
        View {
            eye: self.eye,
            ray_0,
            ray_x,
            ray_y,
            near,
            far,
            view_proj: projection * to_camera,
        }
    }
}

impl View {
    /// The position (mm) seen at pixel coordinates `xy` where the depth buffer holds `depth`.
    pub fn position(&self, xy: DVec2, depth: f64) -> DVec3 {
        self.eye + (self.ray_0 + self.ray_x * xy.x + self.ray_y * xy.y) * self.axial(depth)
    }

    /// Distance along the optical axis (mm) of a depth-buffer value in [0, 1].
    pub fn axial(&self, depth: f64) -> f64 {
        self.near * self.far / (self.far - depth * (self.far - self.near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_picture_shows_what_the_whole_shows_there() {
        let camera = Camera {
            eye: DVec3::new(30.0, 40.0, 120.0),
            target: DVec3::new(1.0, 2.0, 3.0),
            up: DVec3::Y,
            fov: 40.0,
        };
        let size = [151, 97];
        let jitter = DVec2::new(0.3, -0.2);
        let whole = camera.view(size[0], size[1], camera.target, 50.0, jitter);
        let seen = |view: &View, [width, height]: [f64; 2], p: DVec3| {
            let clip = view.view_proj * p.extend(1.0);
            let pixel = (DVec2::new(clip.x, clip.y) / clip.w + 1.0) * 0.5;
            (pixel * DVec2::new(width, height), clip.z / clip.w)
        };
        for part in [
            [0, 0, 151, 97],
            [17, 9, 32, 64],
            [150, 96, 1, 1],
            [64, 0, 87, 5],
        ] {
            let [x, y, width, height] = part.map(f64::from);
            let cropped = whole.cropped(size, part);
            for at in [DVec2::new(0.5, 0.5), DVec2::new(0.25 * width, height - 0.5)] {
                let there = at + DVec2::new(x, y);
                let (p, q) = (cropped.position(at, 0.4), whole.position(there, 0.4));
                assert!(p.distance(q) < 1e-9, "{part:?}, {at}: {p} is not {q}");
                let (pixel, depth) = seen(&cropped, [width, height], p);
                assert!(pixel.distance(at) < 1e-9, "{part:?}, {at}: seen at {pixel}");
                let (pixel, same) = seen(&whole, size.map(f64::from), q);
                assert!(pixel.distance(there) < 1e-9);
                assert!((depth - same).abs() < 1e-12);
            }
        }
        assert_eq!(whole.cropped(size, [0, 0, 151, 97]), whole);
    }
}
