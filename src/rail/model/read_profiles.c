/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles: cross-sections of wheels and rails, by points, or from text files of measuring instruments and of other
 * programs: MiniProf (.ban of rails, .whl of wheels) and Simpack (.prr, .prw). */
#include "rail/model/read_profiles.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>
#include <strings.h>

/* Points that are nearer in y than this, in m, are one: digits of the files end at 1e-7 m. Steeper parts are left out:
 * tan 87 degrees. */
static const double LEAST_STEP = 1e-7, STEEPEST = 19.08;

typedef struct source {
    kmp_points *p;
    int file, line;
    const char *text, *end; /* the present line without its comment */
    bool wheel, simpack;
} source;

static bool complain(const source *s, const char *at, const char *sentence)
{
    const kmp_place place = {.line = s->line, .column = (int)(at - s->text) + 1, .file = s->file};
    return kmp_reader_complain(s->p->r, place, "%s: %s", s->p->what, sentence);
}

/* -- lines ------------------------------------------------------------------------------------------- */

static const char *skip_blank(const source *s, const char *at)
{
    while (at < s->end && strchr(" \t\r,;", *at))
        at++;
    return at;
}

/* Takes the next line of a text, without what follows one of the signs of comments; false at the end. */
static bool next_line(source *s, const char **rest, const char *comments)
{
    if (!**rest)
        return false;
    s->text = *rest;
    s->line++;
    *rest += strcspn(*rest, "\n");
    s->end = s->text;
    while (s->end < *rest && !strchr(comments, *s->end))
        s->end++;
    *rest += **rest == '\n';
    return true;
}

/* True if the line begins with the word, in any case; *behind is what follows it, without blanks. */
static bool begins_with(const source *s, const char *word, const char **behind)
{
    const char *at = skip_blank(s, s->text);
    size_t length = strlen(word);
    if ((size_t)(s->end - at) < length || strncasecmp(at, word, length) != 0)
        return false;
    *behind = skip_blank(s, at + length);
    return true;
}

/* A number with an optional sign that ends at a blank or a separator. */
static bool read_number(const source *s, const char **at, double *value)
{
    const char *from = *at = skip_blank(s, *at);
    bool negative = from < s->end && *from == '-';
    from += from < s->end && (*from == '-' || *from == '+');
    size_t taken = from < s->end ? kmp_text_to_number(from, value) : 0;
    if (taken == 0 || from + taken > s->end || (from + taken < s->end && !strchr(" \t\r,;", from[taken])) ||
        !isfinite(*value))
        return complain(s, *at, "a number is expected here");
    *value = negative ? -*value : *value;
    *at = from + taken;
    return true;
}

/* The number of a line "WORD = NUMBER", which may be missing. True if the line is about the word; *good is false after
 * an error. */
static bool take_number(const source *s, const char *word, double *value, bool *good)
{
    const char *behind;
    if (!begins_with(s, word, &behind) || behind == s->end || *behind != '=')
        return false;
    behind = skip_blank(s, behind + 1);
    *good = (behind == s->end || read_number(s, &behind, value)) && *good;
    return true;
}

/* -- MiniProf ---------------------------------------------------------------------------------------- */

/* The numbers of columns X and Y in "ColumnDef=X,Y,*". */
static bool find_columns(const source *s, const char *at, int column[2])
{
    column[0] = column[1] = -1;
    for (int k = 0; (at = skip_blank(s, at)) < s->end; k++, at++)
        if (*at == 'X' || *at == 'Y')
            column[*at == 'Y'] = k;
    return (column[0] >= 0 && column[1] >= 0) || complain(s, s->text, "ColumnDef must name X and Y");
}

static bool read_row(source *s, const int column[2])
{
    const char *at = s->text;
    double value[2] = {0, 0}, other;
    bool good = true;
    for (int k = 0; good && (k <= column[0] || k <= column[1]); k++)
        good = read_number(s, &at, k == column[0] ? &value[0] : k == column[1] ? &value[1] : &other);
    if (!good)
        return false;
    kmp_points *p = s->p;
    p->x[p->count] = value[0];
    p->y[p->count] = value[1];
    p->place[p->count++] = (kmp_place){.line = s->line, .column = 1, .file = s->file};
    return true;
}

static const char MINIPROF_COMMENTS[] = "\"!%\n";

/* An old file has MINIPROF in one of its first three lines; comments do not count. */
static bool is_old_miniprof(const char *text)
{
    source lines = {0};
    for (int k = 0; k < 3 && next_line(&lines, &text, MINIPROF_COMMENTS);) {
        const char *mark = strstr(lines.text, "MINIPROF");
        if (mark && mark < lines.end)
            return true;
        k += skip_blank(&lines, lines.text) < lines.end;
    }
    return false;
}

/* An old file has words until an empty line; others have NAME=VALUE until rows begin. A row behind a quotation mark is
 * switched off. */
static bool read_miniprof(source *s, const char *text)
{
    const char *rest = text, *behind;
    int column[2] = {0, 1}, rows = 0;
    bool header = true, good = true;
    const bool old = is_old_miniprof(text);
    double announced = 0;
    while (good && next_line(s, &rest, MINIPROF_COMMENTS)) {
        const char *first = skip_blank(s, s->text);
        if (first == s->end) {
            header = header && (!old || (*first && strchr("\"!%", *first)));
            rows += *first == '"' && !memchr(first, '=', strcspn(first, "\n"));
        } else if (begins_with(s, "ColumnDef=", &behind))
            good = find_columns(s, behind, column);
        else if (!take_number(s, "XYPoints", &announced, &good) && !(old && header) &&
                 !memchr(first, '=', (size_t)(s->end - first))) {
            header = false;
            good = read_row(s, column);
            rows++;
        }
    }
    if (good && rows < announced)
        return kmp_reader_complain(s->p->r, (kmp_place){.line = s->line, .column = 1, .file = s->file},
                                   "%s: XYPoints is %.0f, but the file ends after %d points", s->p->what, announced,
                                   rows);
    return good;
}

/* -- Simpack ----------------------------------------------------------------------------------------- */

/* Changes of points that a file demands; lengths in its unit. */
typedef struct changes {
    double type, length, angle, least, shift[2], rotate, from[2], to[2], mirror[2];
} changes;

static bool take_change(const source *s, changes *c, bool *good)
{
    const struct {
        const char *word;
        double *value;
    } words[] = {{"units.len.f", &c->length},  {"units.ang.f", &c->angle},  {"point.dist.min", &c->least},
                 {"shift.y", &c->shift[0]},    {"shift.z", &c->shift[1]},   {"rotate", &c->rotate},
                 {"bound.y.min", &c->from[0]}, {"bound.y.max", &c->to[0]},  {"bound.z.min", &c->from[1]},
                 {"bound.z.max", &c->to[1]},   {"mirror.y", &c->mirror[0]}, {"mirror.z", &c->mirror[1]}};
    bool found = false;
    for (size_t k = 0; k < sizeof words / sizeof *words && !found; k++)
        found = take_number(s, words[k].word, words[k].value, good);
    return found;
}

static bool read_sections(source *s, const char *text, changes *c)
{
    const char *rest = text, *behind;
    bool header = false, points = false, ended = false, good = true;
    while (good && next_line(s, &rest, "!\n")) {
        const char *at = skip_blank(s, s->text);
        if (at == s->end)
            continue;
        if (begins_with(s, "header.begin", &behind) || begins_with(s, "header.end", &behind))
            header = begins_with(s, "header.begin", &behind);
        else if (begins_with(s, "point.begin", &behind) || begins_with(s, "point.end", &behind)) {
            points = begins_with(s, "point.begin", &behind);
            ended = !points;
        } else if (points)
            good = read_row(s, (const int[]){0, 1});
        else if (header && take_number(s, "type", &c->type, &good))
            good = good &&
                   (c->type == s->wheel || complain(s, at, "type is 0 for a rail (.prr) and 1 for a wheel (.prw)"));
        else
            take_change(s, c, &good);
    }
    if (good && !ended)
        return complain(s, s->text, "the file ends without point.end");
    if (good && !(c->length > 0 && c->angle > 0))
        return complain(s, s->text, "the file needs units.len.f, the number of its units of length in a metre");
    return good;
}

static bool read_simpack(source *s, const char *text)
{
    changes c = {.angle = 1};
    if (!read_sections(s, text, &c))
        return false;
    /* The order is Simpack's: distance, shift, rotation, bounds, mirrors. The order of points does not matter
     * here.
     */
    kmp_points *p = s->p;
    double turn = c.rotate / c.angle, last = NAN;
    int count = 0;
    for (int k = 0; k < p->count; k++) {
        double a = p->x[k], b = p->y[k];
        if (c.least > 0 && fabs(a - last) <= c.least)
            continue;
        last = a;
        a += c.shift[0];
        b += c.shift[1];
        double y = a * cos(turn) - b * sin(turn), z = a * sin(turn) + b * cos(turn);
        if (c.from[0] < c.to[0] && (y < c.from[0] || y > c.to[0]))
            continue;
        if (c.from[1] < c.to[1])
            z = fmin(fmax(z, c.from[1]), c.to[1]);
        p->x[count] = (c.mirror[0] == 1 ? -y : y) / c.length;
        p->y[count] = (c.mirror[1] == 1 ? z : -z) / c.length;
        p->place[count++] = p->place[k];
    }
    p->count = count;
    return true;
}

/* -- the part that can touch -------------------------------------------------------------------------- */

/* True if point k is farther than the last one that was kept, to one side in y, and not behind a vertical part. */
static bool is_reached(const kmp_points *p, int last, int k, int side)
{
    double step = side * (p->x[k] - p->x[last]);
    return step >= LEAST_STEP && fabs(p->y[k] - p->y[last]) <= STEEPEST * step;
}

static void copy_point(kmp_points *p, int to, int from)
{
    p->x[to] = p->x[from];
    p->y[to] = p->y[from];
    p->place[to] = p->place[from];
}

static void turn_round(kmp_points *p)
{
    for (int i = 0, k = p->count - 1; i < k; i++, k--) {
        double x = p->x[i], y = p->y[i];
        kmp_place place = p->place[i];
        p->x[i] = p->x[k];
        p->y[i] = p->y[k];
        p->place[i] = p->place[k];
        p->x[k] = x;
        p->y[k] = y;
        p->place[k] = place;
    }
}

/* From the tip, the lowest point of a wheel or the highest of a rail, only points further on in y can be reached. */
static void leave_out_hidden(const source *s)
{
    kmp_points *p = s->p;
    int tip = 0;
    if (p->count < 2)
        return;
    if (p->x[0] > p->x[p->count - 1])
        turn_round(p);
    for (int k = 0; k < p->count; k++)
        tip = (s->wheel ? p->y[k] < p->y[tip] : p->y[k] > p->y[tip]) ? k : tip;
    int first = tip, last = tip;
    for (int k = tip - 1; k >= 0; k--)
        if (is_reached(p, first, k, -1))
            copy_point(p, --first, k);
    for (int k = tip + 1; k < p->count; k++)
        if (is_reached(p, last, k, 1))
            copy_point(p, ++last, k);
    for (int k = first; k <= last; k++)
        copy_point(p, k - first, k);
    p->count = last - first + 1;
}

static bool known_ending(source *s, const kmp_yaml *node)
{
    static const struct {
        const char *ending;
        bool wheel, simpack;
    } kinds[] = {{".ban", false, false}, {".whl", true, false}, {".prr", false, true}, {".prw", true, true}};
    const char *dot = strrchr(node->text, '.');
    for (size_t k = 0; dot && k < sizeof kinds / sizeof *kinds; k++)
        if (strcasecmp(dot, kinds[k].ending) == 0) {
            s->wheel = kinds[k].wheel;
            s->simpack = kinds[k].simpack;
            return true;
        }
    return kmp_reader_complain(s->p->r, node->place,
                               "%s: the ending of '%s' must be .ban or .whl (MiniProf), .prr or .prw (Simpack)",
                               s->p->what, node->text);
}

static bool read_text(source *s, const char *text)
{
    kmp_points *p = s->p;
    int lines = 1;
    for (const char *at = text; *at; at++)
        lines += *at == '\n';
    KMP_ARENA_MAKE(&p->r->scratch, KMP_ROOM(double, lines, &p->x, &p->y), KMP_ROOM(kmp_place, lines, &p->place));
    if (!p->x || !p->y || !p->place)
        return false;
    if (!(s->simpack ? read_simpack(s, text) : read_miniprof(s, text)))
        return false;
    if (!s->simpack) {
        /* Y may be height or depth: the flange of a wheel and the head of a rail are extremes away from both ends. X of
         * a wheel is outwards from the back of its flange; the y of a rail is towards its gauge side. */
        int low = 0, near = p->count / 10;
        for (int k = 0; k < p->count; k++)
            low = p->y[k] < p->y[low] ? k : low;
        bool downwards = low > near && low < p->count - 1 - near;
        double up = (downwards ? -1 : 1) * (s->wheel ? -1 : 1);
        for (int k = 0; k < p->count; k++) {
            p->x[k] *= (s->wheel ? 1 : -1) / 1000.0;
            p->y[k] *= up / 1000;
        }
    }
    leave_out_hidden(s);
    return true;
}

/* Reads the points of the file that `node` names, y outwards and z upwards in m, y ascending. Points are left out
 * that the other surface cannot reach along z: seen from above of a rail, from below of a wheel. False after an
 * error. */
static bool read_profile_file(kmp_points *p, const kmp_yaml *node)
{
    source s = {.p = p};
    size_t length;
    if (!kmp_read_word(p->r, node, p->what) || !known_ending(&s, node))
        return false;
    const char *path = kmp_path_beside(p->r, node->place.file, node->text);
    s.file = kmp_reader_add_file(p->r, path);
    char *text = s.file < 0 ? NULL : kmp_read_file(p->r, KMP_FILE_POINTS, node, p->what, path, &length);
    bool good = text && read_text(&s, text);
    kmp_free(text);
    return good;
}

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

/* A spline that oscillates between its points is not a cross-section. */
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
#include "rail/keys/profile_keys.def"
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
    if (!check_source(&p, file) || !(file ? read_profile_file(&p, file) : kmp_read_points(&p)) || !good ||
        !check_points(&p))
        return;
    if (p.x[0] > p.x[1])
        turn_round(&p);
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
