/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles: cross-sections of wheels and rails, by points. */
#include "rail/model/read_profiles.h"
#include "model/data/model.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "rail/model/profile_files.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

enum { LEAST_POINTS = 4 };

static bool check_points(const kmp_points *p)
{
    if (p->count < LEAST_POINTS)
        return kmp_reader_complain(p->r, p->map->place, "%s: a profile needs at least four points, not %d", p->what,
                                   p->count);
    /* A height over each y: y ascends, or descends, from the first point to the last. */
    double sense = p->x[p->count - 1] - p->x[0];
    for (int k = 1; k < p->count; k++) {
        double step = p->x[k] - p->x[k - 1];
        if (step == 0)
            return kmp_reader_complain(
                p->r, p->place[k],
                "%s: y = %.9g is given twice: a profile has one height for each y; remove one of the "
                "points, a vertical part cannot carry a wheel",
                p->what, p->x[k]);
        if ((step > 0) != (sense > 0))
            return kmp_reader_complain(
                p->r, p->place[k],
                "%s: y decreases from %.9g to %.9g: a profile has one height for each y; remove the overhanging part",
                p->what, p->x[k - 1], p->x[k]);
    }
    return true;
}

/* The largest distance of a piece of the spline from the line between its points, approximately. */
static double swing(const kmp_table *t, int k)
{
    double h = t->x[k + 1] - t->x[k], worst = 0;
    for (int i = 1; i < 8; i++) {
        double u = i / 8.0, line = (1 - u) * t->y[k] + u * t->y[k + 1];
        worst = fmax(worst, fabs(kmp_table_value(t, 0, t->x[k] + u * h) - line));
    }
    return worst;
}

/* A spline that oscillates between its points is no cross-section. */
static bool check_spline(const kmp_points *p, const kmp_table *t)
{
    for (int k = 0; k + 1 < t->count; k++) {
        double apart = hypot(t->x[k + 1] - t->x[k], t->y[k + 1] - t->y[k]), off = swing(t, k);
        if (off <= apart / 4)
            continue;
        return kmp_reader_complain(
            p->r, p->place[k + 1],
            "%s: the spline overshoots between y = %.9g m and %.9g m by %.3g m: add points there", p->what, t->x[k],
            t->x[k + 1], off);
    }
    return true;
}

/* A file in a known format says all about its points. */
static bool check_source(const kmp_points *p, const kmp_yaml *file)
{
    static const char *const others[] = {"y", "z", "csv", "unit"};
    for (size_t k = 0; file && k < sizeof others / sizeof *others; k++) {
        const kmp_yaml *node = kmp_yaml_get(p->map, others[k]);
        if (node)
            return kmp_reader_complain(
                p->r, node->place, "%s: '%s' does not go with 'file', whose format has both coordinates and their unit",
                p->what, others[k]);
    }
    return true;
}

/* The point of the profile at the coordinate `origin` becomes its origin. */
static bool move_origin(const kmp_points *p, kmp_table **height)
{
    const kmp_yaml *node = kmp_yaml_get(p->map, "origin");
    double at;
    if (!node)
        return true;
    if (!kmp_read_fixed(p->r, node, kmp_reader_say(p->r, "origin of %s", p->what), KMP_DIM_LENGTH, &at))
        return false;
    if (!(at >= p->x[0] && at <= p->x[p->count - 1]))
        return kmp_reader_complain(p->r, node->place,
                                   "%s: the origin must be between %.9g m and %.9g m, the ends of the profile", p->what,
                                   p->x[0], p->x[p->count - 1]);
    double up = kmp_table_value(*height, 0, at);
    for (int k = 0; k < p->count; k++) {
        p->x[k] -= at;
        p->y[k] -= up;
    }
    kmp_table_free(*height);
    *height = kmp_table_new(KMP_TABLE_CUBIC, p->count, p->x, p->y);
    p->r->scratch.failed = p->r->scratch.failed || !*height;
    return *height;
}

static void read_profile(kmp_reader *r, const kmp_yaml *map, kmp_profile *profile)
{
    static const kmp_key keys[] = {
#include "model/keys/profile_keys.def"
        {0}};
    kmp_points p = {.r = r,
                    .map = map,
                    .what = kmp_reader_say(r, "profile '%s'", profile->name),
                    .key = {"y", "z"},
                    .dimension = kmp_key_dimension(keys, "y")};
    const kmp_yaml *file = kmp_yaml_get(map, "file");
    kmp_unit unit;
    if (!kmp_read_map(r, map, p.what, keys))
        return;
    bool good = kmp_read_column_unit(&p, KMP_DIM_LENGTH, "a length such as mm", &unit);
    if (!check_source(&p, file) || !(file ? kmp_read_profile_file(&p, file) : kmp_read_points(&p)) || !good ||
        !check_points(&p))
        return;
    if (p.x[0] > p.x[1])
        kmp_points_reverse(&p);
    for (int k = 0; k < p.count; k++) {
        p.x[k] = p.x[k] * unit.factor / unit.divisor;
        p.y[k] = p.y[k] * unit.factor / unit.divisor;
    }
    int bad = kmp_table_check(p.count, p.x, p.y);
    if (bad >= 0)
        kmp_reader_complain(r, p.place[bad], "%s: (%.9g, %.9g) m is not finite or coincides with the point before it",
                            p.what, p.x[bad], p.y[bad]);
    kmp_table *height = bad >= 0 ? NULL : kmp_table_new(KMP_TABLE_CUBIC, p.count, p.x, p.y);
    if (bad < 0 && !height)
        r->scratch.failed = true;
    if (height && check_spline(&p, height) && move_origin(&p, &height))
        profile->height = height;
    else
        kmp_table_free(height);
}

void kmp_read_profiles(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "profiles", "profile");
    model->profiles = KMP_ARENA_NEW(&model->arena, kmp_profile, s.count);
    while (model->profiles && kmp_section_next(&s)) {
        kmp_profile *profile = &model->profiles[model->profile_count++];
        profile->name = s.name;
        read_profile(r, s.node, profile);
    }
}

const kmp_profile *kmp_read_profile(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    int found = kmp_read_reference(r, node, what, "profile", KMP_NAMED(r->model, profile));
    return found < 0 ? NULL : &r->model->profiles[found];
}
