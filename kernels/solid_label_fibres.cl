// Fibres of a label map at the points of stress. Needs common.clh, fibres.clh and -D PARAMETERS, LABEL_FIBRES (as in labels.cl),
// PARAM_geometry_fibres_* where a rule needs them; -D SHEETS for wall normals too.
#if !defined(PARAMETERS) || !defined(LABEL_FIBRES)
#error "solid_label_fibres.cl needs PARAMETERS and LABEL_FIBRES"
#endif

constant uchar label_fibre_rule[] = LABEL_FIBRES;

// place (stride): of a cell in `table`, -1 where there is none. table (cells, 4 points): normal of the wall, or axis, and the
// transmural coordinate. member_of: by block of SOLID_BLOCK cells. direction: as solid_fibres in solid_setup.cl.
kernel void solid_label_fibres(global const real *restrict parameters, global const ushort *restrict member_of,
                               global const int *restrict place, global const uchar *restrict region,
                               global const float4 *restrict table, global real *restrict direction, const int stride) {
  const int i = get_global_id(0);
  if (place[i] < 0) return;
  global const real *P = parameters + (size_t)member_of[i / SOLID_BLOCK] * PARAMETERS;
  const int rule = label_fibre_rule[region[i]];
  for (int g = 0; g < 4; ++g) {
    const float4 d = table[4 * place[i] + g];
    const real3 v = (real3)(d.x, d.y, d.z);
    real3 f = (real3)(0);
#ifdef PARAM_geometry_fibres_endocardium_deg
    if (rule == 1)
      f = helix_fibre(v, helix_angle(d.w, P[PARAM_geometry_fibres_endocardium_deg],
                                     P[PARAM_geometry_fibres_epicardium_deg]));
    if (rule == 2) f = helix_fibre(v, R(0.0));
    if (rule == 3) f = v;
#endif
#ifdef PARAM_geometry_fibres_direction_x
    if (rule == 4) f = unit_or_zero(vector_parameter(P, PARAM_geometry_fibres_direction_x));
#endif
    direction[i + (size_t)(3 * g) * stride] = f.x;
    direction[i + (size_t)(3 * g + 1) * stride] = f.y;
    direction[i + (size_t)(3 * g + 2) * stride] = f.z;
#ifdef SHEETS
    const real3 s = normal_across(rule == 1 || rule == 2 ? v : (real3)(0), f);
    direction[i + (size_t)(12 + 3 * g) * stride] = s.x;
    direction[i + (size_t)(13 + 3 * g) * stride] = s.y;
    direction[i + (size_t)(14 + 3 * g) * stride] = s.z;
#endif
  }
}
