/* SPDX-License-Identifier: BSD-3-Clause */
/* A locus as a picture: eigenvalues in the plane on the left, frequencies over the value on the right (Campbell). */
#include "analyses/modes/modes_print.h"
#include "analyses/modes/modes_study.h"
#include "output/plot.h"
#include <kempe/modes.h>
#include <math.h>

enum { WIDTH = 524, HEIGHT = 400 };

/* Extent of the plane to the left, relative to its height. */
#define FAR 3

/* The drawn point of an eigenvalue: in the plane, or a frequency over the value; NaN: none, as beyond the highest. */
typedef struct drawn {
    double x, y;
} drawn;

/* Value k of what varies, as the axis has it. */
static double swept(const kempe_modes *m, int k)
{
    return kmp_modes_shown(m).factor * m->locus.value[k];
}

typedef drawn point_fn(const kempe_modes *m, int k, int branch);

static drawn in_plane(const kempe_modes *m, int k, int branch)
{
    ptrdiff_t at = branch + (ptrdiff_t)k * m->locus.count;
    const double re = m->locus.re[at], im = fabs(m->locus.im[at]);
    return hypot(re, im) <= m->highest ? (drawn){re, im} : (drawn){NAN, NAN};
}

static drawn over_value(const kempe_modes *m, int k, int branch)
{
    double size = in_plane(m, k, branch).y;
    return (drawn){swept(m, k), size > 0 ? size / (2 * acos(-1)) : NAN};
}

static void reach_branches(kmp_plot *p, const kempe_modes *m, point_fn *point)
{
    for (int k = 0; k < m->locus.reached; k++)
        for (int b = 0; b < m->locus.count; b++)
            kmp_plot_reach(p, point(m, k, b).x, point(m, k, b).y);
}

static void put_branches(kmp_plot *p, const kempe_modes *m, point_fn *point)
{
    for (int b = 0; b < m->locus.count; b++) {
        bool any = false;
        for (int k = 0; k < m->locus.reached; k++)
            any = any || isfinite(point(m, k, b).y);
        if (!any)
            continue;
        const char *colour = kmp_plot_colour(b / 2);
        drawn first = point(m, 0, b);
        kmp_curve_begin(p, "curve", colour);
        for (int k = 0; k < m->locus.reached; k++)
            kmp_curve_to(p, point(m, k, b).x, point(m, k, b).y);
        kmp_curve_end(p);
        if (isfinite(first.y))
            kmp_plot_dot(p, first.x, first.y, colour);
    }
}

static void put_line(kmp_plot *p, const char *class, double x0, double y0, double x1, double y1)
{
    kmp_curve_begin(p, class, NULL);
    kmp_curve_to(p, x0, y0);
    kmp_curve_to(p, x1, y1);
    kmp_curve_end(p);
}

static void put_campbell(kmp_text *text, const kempe_modes *m)
{
    kmp_plot p = kmp_plot_inside(text, WIDTH, 0, WIDTH, HEIGHT);
    kmp_axis *value = &p.axis[0], *frequency = &p.axis[1];
    for (int k = 0; k < m->locus.reached; k++)
        kmp_plot_reach(&p, swept(m, k), 0);
    reach_branches(&p, m, over_value);
    value->name = m->name;
    value->unit = kmp_modes_shown(m).unit;
    frequency->name = "frequency, Hz";
    kmp_plot_begin(&p, m->order_count ? "Frequencies, and orders of what varies" : "Frequencies");
    /* Frequency = order * value / (2 pi), with the order at its end in the frame. */
    for (int k = 0; k < m->order_count; k++) {
        double slope = m->order[k] / (2 * acos(-1) * kmp_modes_shown(m).factor),
               end = fmin(value->high, p.axis[1].high / slope);
        put_line(&p, "order", value->low, slope * value->low, value->high, slope * value->high);
        if (end > value->low)
            kmp_picture_words(p.text, kmp_plot_x(&p, end) - 5, kmp_plot_y(&p, slope * end) + 13,
                              "class=\"order-name\" text-anchor=\"end\"", "%.4g", m->order[k]);
    }
    put_branches(&p, m, over_value);
    for (int k = 0; k < m->locus.critical_count; k++) {
        const kmp_critical *c = &m->locus.critical[k];
        double at = kmp_modes_shown(m).factor * c->value;
        put_line(&p, "critical", at, frequency->low, at, frequency->high);
        kmp_plot_cross(&p, at, kmp_mode_frequency(c->re, c->im));
    }
    kmp_plot_end(&p);
}

static void draw(kmp_text *text, const kempe_modes *m)
{
    kmp_picture_begin(text, 2 * WIDTH, HEIGHT,
                      ".axis{stroke:#4a545a;fill:none}.critical{stroke:#111;stroke-dasharray:2 3;fill:none}"
                      ".order{stroke:#8a949a;stroke-dasharray:7 4;fill:none}.order-name{fill:#6a747a}");
    /* Distant real eigenvalues are cut off, with a note, so that the others remain visible. */
    const kmp_locus *l = &m->locus;
    kmp_plot p = kmp_plot_inside(text, 0, 0, WIDTH, HEIGHT);
    kmp_axis *re = &p.axis[0], *im = &p.axis[1];
    double left = 0;
    kmp_plot_reach(&p, 0, 0);
    reach_branches(&p, m, in_plane);
    for (int k = 0; k < l->reached; k++)
        for (int b = 0; b < l->count; b++)
            left = in_plane(m, k, b).y > 0 ? fmin(left, in_plane(m, k, b).x) : left;
    double least = re->low, bound = fmin(left, -FAR * im->high);
    bool cut = im->high > 0 && least < bound;
    if (cut)
        re->low = bound;
    re->name = "real part, 1/s";
    im->name = "imaginary part, rad/s";
    kmp_shown as = kmp_modes_shown(m);
    kmp_plot_begin(&p, "Eigenvalues, %s from %.6g (dots) to %.6g%s%s", m->name, swept(m, 0), swept(m, l->reached - 1),
                   as.unit[0] ? " " : "", as.unit);
    if (re->low < 0 && re->high > 0)
        put_line(&p, "axis", 0, im->low, 0, im->high);
    put_branches(&p, m, in_plane);
    if (cut)
        kmp_picture_words(text, 8, 18, "", "\xe2\x86\x90 real ones as far as %.4g", least);
    for (int k = 0; k < l->critical_count; k++)
        kmp_plot_cross(&p, l->critical[k].re, l->critical[k].im);
    kmp_plot_end(&p);
    put_campbell(text, m);
    kmp_picture_end(text);
}

kempe_status kempe_modes_write_picture(const kempe_modes *modes, const char *path)
{
    KMP_WANTED(NULL, modes, "modes");
    KMP_WANTED(modes->system->context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(modes->system->context);
    if (!modes->name || modes->locus.reached == 0)
        return kmp_fail(modes->system->context, KEMPE_E_ARGUMENT, "a picture shows what varies, and nothing does");
    draw(&text, modes);
    return kmp_picture_write(modes->system->context, path, &text);
}
