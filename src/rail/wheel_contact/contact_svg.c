/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of contacts as a picture. For each wheel it has the two profiles, a little apart, with the points that touch
 * at each value joined; below, the contacts' values over the swept quantity. */
#include "model/data/model.h"
#include "output/picture_file.h"
#include "output/plot.h"
#include "rail/wheel_contact/contact_print.h"
#include "rail/wheel_contact/contact_sweep.h"
#include "symbolic/table_function.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <math.h>
#include <stdio.h>

enum { WIDTH = 1000, SECTION = 340, PANEL = 260, FINE = 400, LINE = 20 };

#define APART 0.012 /* the wheel is drawn so far above the rail, m */

static const char style[] = ".wheel{fill:none;stroke:#222;stroke-width:1.8}.rail{fill:#e8e8e8;stroke:#222;"
                            "stroke-width:1.8}.join{fill:none;stroke-width:.9}";

typedef struct shade {
    char words[32];
} shade;

/* A colour of SVG, from blue at the first value to red at the last. */
static shade shade_of(const kempe_contacts *t, int row)
{
    double part = t->count > 1 ? (double)row / (t->count - 1) : 0;
    shade s;
    (void)snprintf(s.words, sizeof s.words, "hsl(%.0f 75%% 42%%)", 230 - 230 * part);
    return s;
}

/* -- the profiles ---------------------------------------------------------------------------------------- */

/* A wheel over its rail: lateral places are those on the track, mm, the wheel's where it is at the first value. */
typedef struct section {
    kmp_plot plot;
    const struct kmp_table *wheel, *rail;
    double shift; /* from a place on the wheel to one on the track, m */
} section;

static void go_to(section *s, bool rail, double place)
{
    double height = kmp_table_value(rail ? s->rail : s->wheel, 0, place);
    kmp_curve_to(&s->plot, (place + (rail ? 0 : s->shift)) * 1e3, (height + (rail ? 0 : APART)) * 1e3);
}

static void put_profile(section *s, bool rail)
{
    const struct kmp_table *table = rail ? s->rail : s->wheel;
    double from = table->x[0], to = table->x[table->count - 1];
    kmp_curve_begin(&s->plot, rail ? "rail" : "wheel", NULL);
    for (int k = 0; k <= FINE; k++)
        go_to(s, rail, from + (to - from) * k / FINE);
    kmp_curve_end(&s->plot);
}

/* The lateral distance of the wheel from its rail where it touches first. */
static double find_shift(const kempe_contacts *t, int wheel)
{
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contacts_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, z);
            if (p->touches)
                return p->y - p->s;
        }
    return 0;
}

static void put_section(kmp_text *text, const kempe_contacts *t, int wheel, double x, double y, double width)
{
    const kmp_wheel *w = &t->system->model->wheels[wheel];
    const kmp_track *track = &t->system->model->tracks[w->track];
    section s = {kmp_plot_inside(text, x, y, width, SECTION), w->profile->height, track->rail, find_shift(t, wheel)};
    for (int i = 0; i < s.wheel->count; i++)
        kmp_plot_reach(&s.plot, (s.wheel->x[i] + s.shift) * 1e3, (s.wheel->y[i] + APART) * 1e3);
    for (int i = 0; i < s.rail->count; i++)
        kmp_plot_reach(&s.plot, s.rail->x[i] * 1e3, s.rail->y[i] * 1e3);
    s.plot.axis[0].name = "from the track's middle, outwards, mm";
    s.plot.axis[0].reversed = w->side == KMP_TRACK_LEFT;
    s.plot.square = true;
    kmp_plot_begin(&s.plot, "%s (%s)", w->name, kmp_track_side_words[w->side]);
    put_profile(&s, true);
    put_profile(&s, false);
    /* Lines between the points that touch. */
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contacts_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, z);
            if (!p->touches)
                continue;
            kmp_curve_begin(&s.plot, "join", shade_of(t, row).words);
            go_to(&s, true, p->y);
            go_to(&s, false, p->s);
            kmp_curve_end(&s.plot);
        }
    kmp_plot_end(&s.plot);
}

/* -- curves ---------------------------------------------------------------------------------------------- */

/* A number of patches over the values, by its place in the patch; `law`: the one by the law in the options, 0: none.
 * The unit of the picture, and its size in SI. */
typedef struct panel {
    const char *title, *unit;
    size_t value, law;
    double size;
} panel;

#define AT(member) offsetof(kempe_contact_patch, member)

static const panel panels[] = {{"rolling radius", "mm", AT(radius), 0, 1e-3},
                               {"contact angle", "rad", AT(angle), 0, 1},
                               {"normal force", "kN", AT(normal), 0, 1e3},
                               {"force along", "kN", AT(force[0]), AT(by_law[0]), 1e3},
                               {"force across", "kN", AT(force[1]), AT(by_law[1]), 1e3}};

enum { PANELS = sizeof panels / sizeof *panels, PANELS_A_LINE = 3 };

/* NaN: there is no contact. */
static double value_of(const kempe_contact_patch *p, size_t at, double factor)
{
    return p->touches ? *(const double *)(const void *)((const char *)p + at) * factor : NAN;
}

static int patches_a_value(const kempe_contacts *t)
{
    return t->first[t->wheel_count];
}

/* A swept value as the axis has it. */
static double swept(const kempe_contacts *t, int row)
{
    return kmp_contact_shown(t, kmp_contact_unit(t, 0)).factor * t->value[row];
}

/* A patch over the values; `at`: its number of the panel. */
static void put_curve(kmp_plot *plot, const kempe_contacts *t, int patch, size_t at, double factor)
{
    for (int row = 0; row < t->count; row++)
        kmp_curve_to(plot, swept(t, row), value_of(&t->patch[row * patches_a_value(t) + patch], at, factor));
    kmp_curve_end(plot);
}

static void put_panel(kmp_text *text, const kempe_contacts *t, const panel *of, double x, double y, double width)
{
    kmp_plot plot = kmp_plot_inside(text, x, y, width, PANEL);
    kmp_shown shown = kmp_contact_shown(t, of->unit);
    double factor = shown.factor / of->size;
    for (int k = 0; k < t->count * patches_a_value(t); k++) {
        double at = swept(t, k / patches_a_value(t));
        kmp_plot_reach(&plot, at, value_of(&t->patch[k], of->value, factor));
        kmp_plot_reach(&plot, at, of->law ? value_of(&t->patch[k], of->law, factor) : NAN);
    }
    plot.axis[0].name = t->over.range[0].name;
    plot.axis[0].unit = kmp_contact_shown(t, kmp_contact_unit(t, 0)).unit;
    kmp_plot_begin(&plot, "%s, %s", of->title, shown.unit);
    for (int w = 0; w < t->wheel_count; w++)
        for (int z = t->first[w]; z < t->first[w + 1]; z++) {
            kmp_curve_begin(&plot, "curve", kmp_plot_colour(w));
            put_curve(&plot, t, z, of->value, factor);
            if (!of->law || !t->has_law)
                continue;
            kmp_curve_begin(&plot, "dashed", kmp_plot_colour(w));
            put_curve(&plot, t, z, of->law, factor);
        }
    kmp_plot_end(&plot);
}

/* The difference of the rolling radii over the lateral place, or the conicity over the amplitude. */
static void put_conicities(kmp_text *text, const kempe_contacts *t, bool radii, double x, double y, double width)
{
    const kmp_conicities *c = &t->conicities;
    kmp_plot plot = kmp_plot_inside(text, x, y, width, PANEL);
    int count = radii ? c->points : c->count;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < count; k++) {
            double across = (radii ? c->y[k] : c->at[k].amplitude) * 1e3;
            double up = radii ? c->difference[k] * 1e3 : c->at[k].conicity;
            if (pass == 0)
                kmp_plot_reach(&plot, across, up);
            else
                kmp_curve_to(&plot, across, up);
        }
        if (pass == 0) {
            plot.axis[0].name = radii ? "y, positive to the left" : "amplitude";
            plot.axis[0].unit = "mm";
            kmp_plot_begin(&plot, radii ? "left rolling radius less right one, mm" : "equivalent conicity");
            kmp_curve_begin(&plot, "curve", kmp_plot_colour(0));
        }
    }
    kmp_curve_end(&plot);
    kmp_plot_end(&plot);
}

/* In the last panel's place: the legend of the wheels' colours. */
static void put_legend(kmp_text *text, const kempe_contacts *t, double x, double y)
{
    for (int w = 0; w < t->wheel_count; w++, y += LINE)
        kmp_picture_entry(text, x, y, "curve", kmp_plot_colour(w), "%s", t->system->model->wheels[w].name);
    if (t->has_law)
        kmp_picture_entry(text, x, y, "dashed", "#222", "by %s", kmp_contact_law_word(t));
    kmp_picture_words(text, x, y + 1.5 * LINE, "", "lines join what touches, from");
    kmp_picture_entry(text, x, y + 2.5 * LINE, "curve", shade_of(t, 0).words, "%.6g to", swept(t, 0));
    const char *unit = kmp_contact_shown(t, kmp_contact_unit(t, 0)).unit;
    kmp_picture_entry(text, x, y + 3.5 * LINE, "curve", shade_of(t, t->count - 1).words, "%.6g%s%s",
                      swept(t, t->count - 1), unit[0] ? " " : "", unit);
}

kempe_status kempe_contacts_write_picture(const kempe_contacts *t, const char *path)
{
    KMP_WANTED(NULL, t, "table");
    KMP_WANTED(t->given->context, path, "path");
    kempe_context *context = t->given->context;
    kmp_text text = {0};
    int lines = (t->wheel_count + 1) / 2, columns = t->wheel_count > 1 ? 2 : 1;
    int below = lines * SECTION + (PANELS + 1 + PANELS_A_LINE - 1) / PANELS_A_LINE * PANEL;
    int height = below + (t->conicities.count > 0 ? PANEL : 0);
    double width = WIDTH / (double)columns, narrow = WIDTH / (double)PANELS_A_LINE;
    kmp_context_clear(context);
    kmp_picture_begin(&text, WIDTH, height, style);
    for (int w = 0; w < t->wheel_count; w++) {
        int line = w / columns;
        put_section(&text, t, w, w % columns * width, line * SECTION, width);
    }
    for (int k = 0; k < PANELS; k++) {
        int line = k / PANELS_A_LINE;
        put_panel(&text, t, &panels[k], k % PANELS_A_LINE * narrow, lines * SECTION + line * PANEL, narrow);
    }
    put_legend(&text, t, WIDTH - narrow + 4 * LINE, below - PANEL + 3 * LINE);
    for (int k = 0; k < 2 && t->conicities.count > 0; k++)
        put_conicities(&text, t, k == 0, k * WIDTH / 2.0, below, WIDTH / 2.0);
    kmp_picture_end(&text);
    return kmp_picture_write(context, path, &text);
}
