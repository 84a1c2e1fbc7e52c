// The dipole of Jensen et al. 2001, three channels at once. CPU twin: optics/dipole.rs.

const float LOG2_E = 1.44269504088896;

// 4 pi / alpha' times R_d at squared distance `r2`, eq. 4 of that paper, times e^offset: the
// sampling of a wide gap divides by exponentials that float32 cannot hold.
vec3 profile(float r2, vec3 offset) {
    vec3 sigma = frame.sigma_tr.rgb;
    vec3 z_r = frame.z_r.rgb, z_v = frame.z_v.rgb;
    vec3 s_r = r2 + z_r * z_r, s_v = r2 + z_v * z_v;
    vec3 i_r = inversesqrt(s_r), i_v = inversesqrt(s_v);
    vec3 x_r = sigma * s_r * i_r, x_v = sigma * s_v * i_v;
    return z_r * (1.0 + x_r) * exp2(LOG2_E * (offset - x_r)) * i_r * i_r * i_r
         + z_v * (1.0 + x_v) * exp2(LOG2_E * (offset - x_v)) * i_v * i_v * i_v;
}

// R_d per mm^2 at squared distance `r2`.
vec3 r_d(float r2) {
    return frame.alpha_prime.rgb * (0.25 / PI) * profile(r2, vec3(0.0));
}
