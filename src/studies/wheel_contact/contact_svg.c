/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of contacts as a picture. For each wheel it has the two profiles, a little apart, with the points that touch
 * at each value joined; below, the contacts' values over the swept quantity. */
#include "base/file.h"
#include "model/model.h"
#include "output/svg.h"
#include "studies/wheel_contact/contact_sweep.h"
#include "symbolic/table.h"
#include <kempe/contact.h>
#include <kempe/contact_table.h>
#include <math.h>

enum {
    WIDTH = 1000,
    SECTION = 330,
    PANEL = 250,
    LEFT = 66,
    RIGHT = 14,
    TOP = 34,
    BOTTOM = 44,
    FINE = 400,
    COLOURS = 6
};

#define APART 0.012 /* the wheel is drawn so far above the rail, m */

static const char *const colours[COLOURS] = {"#2471a3", "#c0392b", "#1e8449", "#b9770e", "#7d3c98", "#5d6d7e"};

static const char style[] = ".frame{fill:none;stroke:#888}.grid{stroke:#ddd;fill:none}.title{font-weight:bold}"
                            ".wheel{fill:none;stroke:#222;stroke-width:1.8}.rail{fill:#e8e8e8;stroke:#222;"
                            "stroke-width:1.8}.join{fill:none;stroke-width:.9}.curve{fill:none;stroke-width:1.6}"
                            ".law{fill:none;stroke-width:1.2;stroke-dasharray:5 3}";

/* A rectangle of the picture with its own axes; `mirrored`: x counts to the left. */
typedef struct frame {
    kmp_text *text;
    double x, y, width, height; /* of the inner rectangle */
    double low[2], high[2];
    bool mirrored;
} frame;

static double at_x(const frame *f, double x)
{
    double part = (x - f->low[0]) / (f->high[0] - f->low[0]);
    return f->x + f->width * (f->mirrored ? 1 - part : part);
}

static double at_y(const frame *f, double y)
{
    return f->y + f->height * (1 - (y - f->low[1]) / (f->high[1] - f->low[1]));
}

static void reach(frame *f, double x, double y)
{
    const double p[2] = {x, y};
    for (int k = 0; k < 2 && isfinite(x) && isfinite(y); k++) {
        f->low[k] = fmin(f->low[k], p[k]);
        f->high[k] = fmax(f->high[k], p[k]);
    }
}

static void put_ticks(const frame *f, int axis, int count)
{
    double each = kmp_svg_tick(f->high[axis] - f->low[axis], count);
    for (double k = ceil(f->low[axis] / each); k * each <= f->high[axis]; k++) {
        double v = k * each, x = at_x(f, v), y = at_y(f, v);
        if (axis == 0)
            kmp_text_printf(f->text,
                            "<path class=\"grid\" d=\"M%.1f %.1f v%.1f\"/><text x=\"%.1f\" y=\"%.1f\" "
                            "text-anchor=\"middle\">%.6g</text>\n",
                            x, f->y, f->height, x, f->y + f->height + 16, k == 0 ? 0 : v);
        else
            kmp_text_printf(f->text,
                            "<path class=\"grid\" d=\"M%.1f %.1f h%.1f\"/><text x=\"%.1f\" y=\"%.1f\" "
                            "text-anchor=\"end\">%.6g</text>\n",
                            f->x, y, f->width, f->x - 6, y + 4, k == 0 ? 0 : v);
    }
}

static void put_frame(const frame *f, const char *title, const char *across)
{
    put_ticks(f, 0, f->width > 400 ? 8 : 5);
    put_ticks(f, 1, 5);
    kmp_text_printf(f->text,
                    "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" class=\"frame\"/>\n"
                    "<text class=\"title\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">",
                    f->x, f->y, f->width, f->height, f->x + f->width / 2, f->y - 10);
    kmp_text_escape(f->text, title);
    kmp_text_printf(f->text, "</text>\n<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", f->x + f->width / 2,
                    f->y + f->height + 34);
    kmp_text_escape(f->text, across);
    kmp_text_put(f->text, "</text>\n");
}

/* Appends a colour, from blue at the first value to red at the last. */
static void put_colour(kmp_text *text, const kempe_contact_table *t, int row)
{
    double part = t->count > 1 ? (double)row / (t->count - 1) : 0;
    kmp_text_printf(text, "hsl(%.0f 75%% 42%%)", 230 - 230 * part);
}

/* -- the profiles ---------------------------------------------------------------------------------------- */

/* A wheel over its rail: lateral places are those on the track, mm, the wheel's where it is at the first value. */
typedef struct section {
    frame f;
    const struct kmp_table *wheel, *rail;
    double shift; /* from a place on the wheel to one on the track, m */
} section;

static double wheel_height(const section *s, double place)
{
    return kmp_table_value(s->wheel, 0, place) + APART;
}

static void put_profile(const section *s, bool rail)
{
    const struct kmp_table *table = rail ? s->rail : s->wheel;
    double from = table->x[0], to = table->x[table->count - 1], shift = rail ? 0 : s->shift;
    kmp_text_printf(s->f.text, "<path class=\"%s\" d=\"", rail ? "rail" : "wheel");
    for (int k = 0; k <= FINE; k++) {
        double x = from + (to - from) * k / FINE, z = rail ? kmp_table_value(table, 0, x) : wheel_height(s, x);
        kmp_text_printf(s->f.text, "%s%.2f %.2f", k ? " L" : "M", at_x(&s->f, (x + shift) * 1e3), at_y(&s->f, z * 1e3));
    }
    kmp_text_printf(s->f.text, "\"/>\n");
}

static void put_joins(const section *s, const kempe_contact_table *t, int wheel)
{
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contact_table_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contact_table_patch(t, row, wheel, z);
            if (!p->touches)
                continue;
            double x[2] = {at_x(&s->f, p->y * 1e3), at_x(&s->f, (p->s + s->shift) * 1e3)};
            double y[2] = {at_y(&s->f, kmp_table_value(s->rail, 0, p->y) * 1e3),
                           at_y(&s->f, wheel_height(s, p->s) * 1e3)};
            kmp_text_printf(s->f.text, "<path class=\"join\" d=\"M%.2f %.2f L%.2f %.2f\" stroke=\"", x[0], y[0], x[1],
                            y[1]);
            put_colour(s->f.text, t, row);
            kmp_text_put(s->f.text, "\"/>\n");
        }
}

/* The lateral distance of the wheel from its rail where it touches first. */
static double find_shift(const kempe_contact_table *t, int wheel)
{
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contact_table_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contact_table_patch(t, row, wheel, z);
            if (p->touches)
                return p->y - p->s;
        }
    return 0;
}

static void put_section(kmp_text *text, const kempe_contact_table *t, int wheel, double x, double y, double width)
{
    const kmp_wheel *w = &t->system->model->wheels[wheel];
    const kmp_track *track = &t->system->model->tracks[w->track];
    section s = {{text,
                  x + LEFT,
                  y + TOP,
                  width - LEFT - RIGHT,
                  SECTION - TOP - BOTTOM,
                  {INFINITY, INFINITY},
                  {-INFINITY, -INFINITY},
                  w->side == KMP_TRACK_LEFT},
                 w->profile->height,
                 track->rail,
                 find_shift(t, wheel)};
    const struct kmp_table *tables[] = {s.wheel, s.rail};
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < tables[k]->count; i++)
            reach(&s.f, (tables[k]->x[i] + (k ? 0 : s.shift)) * 1e3, (tables[k]->y[i] + (k ? 0 : APART)) * 1e3);
    /* the same scale in both directions */
    double middle = (s.f.low[0] + s.f.high[0]) / 2,
           each = fmax((s.f.high[0] - s.f.low[0]) / s.f.width, (s.f.high[1] - s.f.low[1]) / s.f.height) * 1.04;
    s.f.low[0] = middle - each * s.f.width / 2;
    s.f.high[0] = middle + each * s.f.width / 2;
    middle = (s.f.low[1] + s.f.high[1]) / 2;
    s.f.low[1] = middle - each * s.f.height / 2;
    s.f.high[1] = middle + each * s.f.height / 2;
    kmp_text title = {0};
    kmp_text_printf(&title, "%s (%s)", w->name, kmp_track_side_words[w->side]);
    put_frame(&s.f, title.s ? title.s : "", "from the track's middle, outwards, mm");
    kmp_text_free(&title);
    put_profile(&s, true);
    put_profile(&s, false);
    put_joins(&s, t, wheel);
}

/* -- curves -------------------------------------------------------------------------------------------- */

/* The drawn value of a patch; NaN: none. */
typedef double value_fn(const kempe_contact_patch *p);

static double radius_of(const kempe_contact_patch *p)
{
    return p->radius * 1e3;
}

static double angle_of(const kempe_contact_patch *p)
{
    return p->angle;
}

static double normal_of(const kempe_contact_patch *p)
{
    return p->normal / 1e3;
}

static double along_of(const kempe_contact_patch *p)
{
    return p->force[0] / 1e3;
}

static double across_of(const kempe_contact_patch *p)
{
    return p->force[1] / 1e3;
}

static double law_along_of(const kempe_contact_patch *p)
{
    return p->by_law[0] / 1e3;
}

static double law_across_of(const kempe_contact_patch *p)
{
    return p->by_law[1] / 1e3;
}

typedef struct panel {
    const char *title;
    value_fn *value, *by_law;
} panel;

static const panel panels[] = {{"rolling radius, mm", radius_of, NULL},
                               {"contact angle, rad", angle_of, NULL},
                               {"normal force, kN", normal_of, NULL},
                               {"force along, kN", along_of, law_along_of},
                               {"force across, kN", across_of, law_across_of}};

enum { PANELS = sizeof panels / sizeof *panels, PANELS_A_LINE = 3 };

static void put_curve(const frame *f, const kempe_contact_table *t, int wheel, int zone, value_fn *value,
                      const char *class)
{
    bool open = false;
    for (int row = 0; row < t->count; row++) {
        const kempe_contact_patch *p = kempe_contact_table_patch(t, row, wheel, zone);
        double y = p->touches ? value(p) : NAN, x = t->value[row];
        if (isfinite(y) && !open)
            kmp_text_printf(f->text, "<path class=\"%s\" stroke=\"%s\" d=\"", class, colours[wheel % COLOURS]);
        if (isfinite(y))
            kmp_text_printf(f->text, "%s%.2f %.2f", open ? " L" : "M", at_x(f, x), at_y(f, y));
        else if (open)
            kmp_text_put(f->text, "\"/>\n");
        open = isfinite(y);
    }
    if (open)
        kmp_text_put(f->text, "\"/>\n");
}

static void reach_all(frame *f, const kempe_contact_table *t, const panel *drawn)
{
    for (int row = 0; row < t->count; row++)
        for (int w = 0; w < t->wheel_count; w++)
            for (int z = 0; z < kempe_contact_table_zone_count(t, w); z++) {
                const kempe_contact_patch *p = kempe_contact_table_patch(t, row, w, z);
                if (p->touches)
                    reach(f, t->value[row], drawn->value(p));
                if (p->touches && drawn->by_law)
                    reach(f, t->value[row], drawn->by_law(p));
            }
    for (int k = 0; k < 2; k++) {
        double room = f->high[k] - f->low[k];
        room = room > 0 ? (k ? 0.06 * room : 0) : fmax(fabs(f->high[k]), 1) / 2;
        if (!isfinite(room)) {
            f->low[k] = 0;
            f->high[k] = room = 1;
        }
        f->low[k] -= room;
        f->high[k] += room;
    }
}

static void put_panel(kmp_text *text, const kempe_contact_table *t, const panel *drawn, double x, double y,
                      double width)
{
    frame f = {text,
               x + LEFT,
               y + TOP,
               width - LEFT - RIGHT,
               PANEL - TOP - BOTTOM,
               {INFINITY, INFINITY},
               {-INFINITY, -INFINITY},
               false};
    reach_all(&f, t, drawn);
    put_frame(&f, drawn->title, t->over.range[0].name);
    for (int w = 0; w < t->wheel_count; w++)
        for (int z = 0; z < kempe_contact_table_zone_count(t, w); z++) {
            put_curve(&f, t, w, z, drawn->value, "curve");
            if (drawn->by_law && t->has_law)
                put_curve(&f, t, w, z, drawn->by_law, "law");
        }
}

/* In the last panel's place: the legend of the wheels' colours. */
static void put_legend(kmp_text *text, const kempe_contact_table *t, double x, double y)
{
    for (int w = 0; w < t->wheel_count; w++) {
        kmp_text_printf(text, "<path class=\"curve\" stroke=\"%s\" d=\"M%.1f %.1f h30\"/><text x=\"%.1f\" y=\"%.1f\">",
                        colours[w % COLOURS], x + LEFT, y + TOP + 20 * (w + 1), x + LEFT + 38,
                        y + TOP + 20 * (w + 1) + 4);
        kmp_text_escape(text, t->system->model->wheels[w].name);
        kmp_text_put(text, "</text>\n");
    }
    double line = y + TOP + 20 * (t->wheel_count + 1);
    if (t->has_law)
        kmp_text_printf(
            text,
            "<path class=\"law\" stroke=\"#222\" d=\"M%.1f %.1f h30\"/><text x=\"%.1f\" y=\"%.1f\">by %s</text>\n",
            x + LEFT, line, x + LEFT + 38, line + 4, kempe_contact_law_name(t->law));
    kmp_text_printf(
        text, "<text x=\"%.1f\" y=\"%.1f\">lines join what touches, from</text><text x=\"%.1f\" y=\"%.1f\" fill=\"",
        x + LEFT, line + 24, x + LEFT, line + 42);
    put_colour(text, t, 0);
    kmp_text_printf(text, "\">%.6g</text><text x=\"%.1f\" y=\"%.1f\">to</text><text x=\"%.1f\" y=\"%.1f\" fill=\"",
                    t->value[0], x + LEFT + 60, line + 42, x + LEFT + 84, line + 42);
    put_colour(text, t, t->count - 1);
    kmp_text_printf(text, "\">%.6g</text>\n", t->value[t->count - 1]);
}

kempe_status kempe_contact_table_write_svg(const kempe_contact_table *t, const char *path)
{
    KMP_WANTED(NULL, t, "table");
    KMP_WANTED(t->given->context, path, "path");
    kempe_context *context = t->given->context;
    kmp_text text = {0};
    int lines = (t->wheel_count + 1) / 2, columns = t->wheel_count > 1 ? 2 : 1;
    int height = lines * SECTION + (PANELS + 1 + PANELS_A_LINE - 1) / PANELS_A_LINE * PANEL;
    kmp_context_clear(context);
    kmp_svg_begin(&text, WIDTH, height, style);
    for (int w = 0; w < t->wheel_count; w++) {
        int line = w / columns;
        put_section(&text, t, w, w % columns * (WIDTH / (double)columns), line * SECTION, WIDTH / (double)columns);
    }
    double width = WIDTH / (double)PANELS_A_LINE;
    for (int k = 0; k <= PANELS; k++) {
        int line = k / PANELS_A_LINE;
        double x = k % PANELS_A_LINE * width, y = lines * SECTION + line * PANEL;
        if (k < PANELS)
            put_panel(&text, t, &panels[k], x, y, width);
        else
            put_legend(&text, t, x, y);
    }
    kmp_svg_end(&text);
    return kmp_file_write(context, path, &text);
}
