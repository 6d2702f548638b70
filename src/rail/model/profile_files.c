/* SPDX-License-Identifier: BSD-3-Clause */
#include "rail/model/profile_files.h"
#include "base/memory.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
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

static void add_point(source *s, double y, double z)
{
    kmp_points *p = s->p;
    p->x[p->count] = y;
    p->y[p->count] = z;
    p->place[p->count++] = (kmp_place){.line = s->line, .column = 1, .file = s->file};
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
    if (good)
        add_point(s, value[0], value[1]);
    return good;
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

/* Y may be height or depth. The flange of a wheel and the head of a rail are extremes away from both ends; true if that
 * extreme is the least Y. */
static bool bulges_to_negative(const kmp_points *p)
{
    int low = 0, near = p->count / 10;
    for (int k = 0; k < p->count; k++)
        low = p->y[k] < p->y[low] ? k : low;
    return low > near && low < p->count - 1 - near;
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

static bool check_type(const source *s, const char *at, const changes *c)
{
    return c->type == s->wheel || complain(s, at, "type is 0 for a rail (.prr) and 1 for a wheel (.prw)");
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
            good = good && check_type(s, at, c);
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
    /* The order is that of Simpack: distance, shift, rotation, bounds, mirrors. The order of points does not matter
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

/* From the tip, the lowest point of a wheel or the highest of a rail, only points further on in y can be reached. */
static void leave_out_hidden(const source *s)
{
    kmp_points *p = s->p;
    int tip = 0;
    if (p->count < 2)
        return;
    if (p->x[0] > p->x[p->count - 1])
        kmp_points_reverse(p);
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

/* -- all ---------------------------------------------------------------------------------------------- */

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
        /* X of a wheel is outwards from the back of its flange; that of a rail is towards its gauge side. */
        double up = (bulges_to_negative(s->p) ? -1 : 1) * (s->wheel ? -1 : 1);
        for (int k = 0; k < s->p->count; k++) {
            s->p->x[k] *= (s->wheel ? 1 : -1) / 1000.0;
            s->p->y[k] *= up / 1000;
        }
    }
    leave_out_hidden(s);
    return true;
}

bool kmp_read_profile_file(kmp_points *p, const kmp_yaml *node)
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
