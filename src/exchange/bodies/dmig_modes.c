/* SPDX-License-Identifier: BSD-3-Clause */
/* A card is a line with its continuations: fields of 8 columns, of 16 after a name with a star, or between commas.
 * Entries of matrices are, after the name and its column, groups of grid point, component, real and imaginary part. The
 * integrals of the body follow from the mass of its rigid motions, which the places of the interfaces give. */
#include "exchange/bodies/dmig_modes.h"
#include "exchange/bodies/fortran_text.h"
#include "linalg/dense/factors.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rigid motions have the same mass in all directions, and no stiffness, to the ten digits of punched numbers. */
static const double ALIKE = 1e-6;

typedef struct field {
    const char *s;
    size_t length;
    int line, column;
} field;

typedef enum matrix { STIFFNESS, MASS, DAMPING, LOSS, MATRICES } matrix;

static const char *const what[MATRICES] = {"stiffness", "mass", "damping", "structural damping"};

/* A component of a grid point, 1 to 6, or the only one of a scalar point, 0. */
typedef struct component {
    int point, number;
} component;

typedef struct entry {
    int line;
    component column, row;
    double value;
} entry;

typedef struct grid {
    int number, line;
    double at[3];
} grid;

typedef struct reading {
    const kmp_modal_source *source;
    bool beside; /* the text with the nodes is read */
    int card_line, field_count;
    char name[16];
    field *fields; /* of the card */
    struct {
        char name[16];
        int line, form; /* 0: it is absent; 1 square, 6 symmetric */
        int count;
        entry *entries;
    } matrix[MATRICES];
    int grid_count;
    grid *grids;
    int count;
    component *components; /* in order: coordinates of the body */
} reading;

#define REFUSE(s, ...) (note_text(s), kmp_modal_refuse_at((s)->source, (s)->card_line, 1, __VA_ARGS__))

#define REFUSE_AT(s, field, ...)                                                                                       \
    (note_text(s), kmp_modal_refuse_at((s)->source, (field)->line, (field)->column, __VA_ARGS__))

static void note_text(const reading *s)
{
    s->source->to->beside = s->beside;
}

/* -- cards ------------------------------------------------------------------------------------------- */

static bool add_field(reading *s, const kmp_text_line *line, size_t at, size_t length)
{
    field *fields = kmp_arena_room(s->source->arena, s->fields, s->field_count, sizeof *fields);
    kmp_text_line own = {.s = line->s + at, .length = length, .column = (int)at + 1};
    if (!fields)
        return false;
    kmp_text_line_trim(&own);
    s->fields = fields;
    fields[s->field_count++] = (field){.s = own.s, .length = own.length, .line = line->number, .column = own.column};
    return true;
}

/* The fields of a line behind its first one, as many as its kind has. */
static bool add_fields(reading *s, const kmp_text_line *line, bool free, bool wide)
{
    const size_t width = wide ? 16 : 8, count = wide ? 4 : 8;
    size_t at = free ? strcspn(line->s, ",") + 1 : 8;
    bool good = true;
    for (size_t k = 0; k < count && good; k++) {
        const size_t rest = at < line->length ? line->length - at : 0;
        const char *comma = free && rest > 0 ? memchr(line->s + at, ',', rest) : NULL;
        const size_t own = !free ? (rest < width ? rest : width) : comma ? (size_t)(comma - line->s) - at : rest;
        good = add_field(s, line, rest > 0 ? at : line->length, own);
        at += free ? own + 1 : width;
    }
    return good;
}

/* A field of the card; an empty one where it has fewer. */
static const field *field_at(const reading *s, int k)
{
    static const field none = {.s = ""};
    return s->fields && k < s->field_count ? &s->fields[k] : &none;
}

static bool read_whole(const reading *s, int k, const char *of, int *value)
{
    const field *own = field_at(s, k);
    *value = 0;
    return own->length == 0 || kmp_fortran_whole(own->s, own->length, value) ||
           REFUSE_AT(s, own, "%s of card %s is '%.*s': a whole number is expected", of, s->name, (int)own->length,
                     own->s);
}

static bool read_real(const reading *s, int k, const char *of, double *value)
{
    const field *own = field_at(s, k);
    *value = 0;
    return own->length == 0 || (kmp_fortran_number(own->s, own->length, value) && fabs(*value) <= KMP_MODAL_LARGEST) ||
           REFUSE_AT(s, own, "%s of card %s is '%.*s': a number up to %g is expected", of, s->name, (int)own->length,
                     own->s, KMP_MODAL_LARGEST);
}

static bool read_grid(reading *s)
{
    int system = 0, output = 0;
    grid own = {.line = s->card_line}, *grids;
    if (!read_whole(s, 0, "the number", &own.number) || !read_whole(s, 1, "CP", &system) ||
        !read_whole(s, 5, "CD", &output))
        return false;
    for (int k = 0; k < 3; k++)
        if (!read_real(s, 2 + k, "a coordinate", &own.at[k]))
            return false;
    if (system != 0 || output != 0)
        return REFUSE(s,
                      "grid point %d is in the coordinate system %s = %d: places and displacements in the basic "
                      "system are read, CP = CD = 0",
                      own.number, system != 0 ? "CP" : "CD", system != 0 ? system : output);
    if (!(grids = kmp_arena_room(s->source->arena, s->grids, s->grid_count, sizeof *grids)))
        return false;
    s->grids = grids;
    grids[s->grid_count++] = own;
    return true;
}

/* The kind of a matrix by its name: KAAX, MAAX, BAAX, K4AAX, or another one with these beginnings. */
static matrix kind_of(const field *name)
{
    const char first = name->length > 0 ? *name->s : 0;
    const bool loss = name->length > 1 && name->s[1] == '4';
    if (first == 'K' || first == 'k')
        return loss ? LOSS : STIFFNESS;
    return first == 'M' || first == 'm' ? MASS : first == 'B' || first == 'b' ? DAMPING : MATRICES;
}

static bool begin_matrix(reading *s, matrix kind)
{
    int form = 0, type = 0;
    if (!read_whole(s, 2, "the form", &form) || !read_whole(s, 3, "the type", &type))
        return false;
    if (s->matrix[kind].line > 0)
        return REFUSE(s, "a second matrix of %s: one of them is '%s', of line %d", what[kind], s->matrix[kind].name,
                      s->matrix[kind].line);
    if (form != 1 && form != 6)
        return REFUSE(s, "the matrix of %s has the form %d: 1, square, and 6, symmetric, are read", what[kind], form);
    if (type > 2)
        return REFUSE(s, "the matrix of %s has the type %d: 1 and 2, real numbers, are read", what[kind], type);
    s->matrix[kind].line = s->card_line;
    s->matrix[kind].form = form;
    const field *name = field_at(s, 0);
    memcpy(s->matrix[kind].name, name->s, name->length < 15 ? name->length : 15);
    return true;
}

static bool read_matrix(reading *s)
{
    const field *name = field_at(s, 0);
    const matrix kind = kind_of(name);
    entry own = {.line = s->card_line};
    if (kind == MATRICES) /* loads and others */
        return true;
    if (!read_whole(s, 1, "the grid point of a column", &own.column.point) ||
        !read_whole(s, 2, "the component of a column", &own.column.number))
        return false;
    if (own.column.point == 0)
        return begin_matrix(s, kind);
    if (s->matrix[kind].line == 0 || strlen(s->matrix[kind].name) != name->length ||
        memcmp(s->matrix[kind].name, name->s, name->length) != 0)
        return REFUSE(s, "a column of the matrix '%.*s' without its first card, DMIG %.*s 0 ..", (int)name->length,
                      name->s, (int)name->length, name->s);
    for (int k = 4; k < s->field_count; k += 4) {
        if (field_at(s, k)->length == 0)
            continue;
        if (!read_whole(s, k, "a grid point", &own.row.point) ||
            !read_whole(s, k + 1, "a component", &own.row.number) || !read_real(s, k + 2, "an entry", &own.value))
            return false;
        entry *entries =
            kmp_arena_room(s->source->arena, s->matrix[kind].entries, s->matrix[kind].count, sizeof *entries);
        if (!entries)
            return false;
        s->matrix[kind].entries = entries;
        entries[s->matrix[kind].count++] = own;
    }
    return true;
}

/* A whole card: others than matrices and grid points are not of this body. */
static bool take_card(reading *s)
{
    int system = 0, output = 0;
    if (strcmp(s->name, "GRID") == 0)
        return read_grid(s);
    if (strcmp(s->name, "DMIG") == 0 && !s->beside)
        return read_matrix(s);
    if (strcmp(s->name, "GRDSET") != 0)
        return true;
    return read_whole(s, 1, "CP", &system) && read_whole(s, 5, "CD", &output) &&
           ((system == 0 && output == 0) ||
            REFUSE(s, "GRDSET gives all grid points a coordinate system: places and displacements in the basic system "
                      "are read"));
}

/* The name of a card in capitals, without its star; "": a continuation. */
static void name_card(reading *s, const kmp_text_line *line, size_t length, bool *wide)
{
    kmp_text_line own = {.s = line->s, .length = length};
    size_t count = 0;
    kmp_text_line_trim(&own);
    *wide = own.length > 0 && (own.s[own.length - 1] == '*' || *own.s == '*');
    own.length -= own.length > 0 && own.s[own.length - 1] == '*';
    for (; count < own.length && count < sizeof s->name - 1; count++)
        s->name[count] = (char)(own.s[count] >= 'a' && own.s[count] <= 'z' ? own.s[count] - 'a' + 'A' : own.s[count]);
    s->name[count] = '\0';
}

static bool read_cards(reading *s, const char *text)
{
    kmp_text_line line = {.rest = text};
    char name[sizeof s->name] = "";
    while (kmp_text_line_next(&line)) {
        bool wide;
        const char *comment = memchr(line.s, '$', line.length);
        line.length = comment ? (size_t)(comment - line.s) : line.length;
        kmp_text_line blank = line;
        kmp_text_line_trim(&blank);
        if (blank.length == 0)
            continue;
        const bool free = memchr(line.s, ',', line.length);
        const size_t first = free ? strcspn(line.s, ",") : line.length < 8 ? line.length : 8;
        const bool more = first == 0 || *line.s == '+' || *line.s == '*' || *line.s == ' ';
        if (!more && (!take_card(s) || s->source->arena->failed))
            return false;
        if (!more) {
            s->card_line = line.number;
            s->field_count = 0;
        }
        memcpy(name, s->name, sizeof name);
        name_card(s, &line, first, &wide);
        if (more)
            memcpy(s->name, name, sizeof name);
        if (!free && memchr(line.s, '\t', line.length) &&
            (strncmp(s->name, "DMIG", 4) == 0 || strncmp(s->name, "GRID", 4) == 0))
            return REFUSE(s, "card %.4s has a tab: its columns are not known; write blanks", s->name);
        if (!add_fields(s, &line, free, wide))
            return false;
    }
    const bool good = take_card(s);
    s->name[0] = '\0';
    s->field_count = 0;
    return good;
}

/* -- coordinates ------------------------------------------------------------------------------------- */

static int compare_components(const void *a, const void *b)
{
    const component *x = a, *y = b;
    return x->point != y->point ? (x->point < y->point ? -1 : 1) : (x->number > y->number) - (x->number < y->number);
}

static int find_component(const reading *s, component wanted)
{
    const component *found = bsearch(&wanted, s->components, (size_t)s->count, sizeof wanted, compare_components);
    return found ? (int)(found - s->components) : -1;
}

/* The components of the diagonal of mass and stiffness, and all others that occur. */
static bool list_components(reading *s)
{
    ptrdiff_t all = 0;
    for (int k = 0; k < MATRICES; k++)
        all += 2 * (ptrdiff_t)s->matrix[k].count;
    component *list = kmp_arena_alloc(s->source->arena, (size_t)all + 1, sizeof *list);
    all = 0;
    for (int k = 0; k < MATRICES && list; k++)
        for (int e = 0; e < s->matrix[k].count; e++) {
            const entry *own = &s->matrix[k].entries[e];
            if (own->column.point < 1 || own->row.point < 1 || own->column.number < 0 || own->column.number > 6 ||
                own->row.number < 0 || own->row.number > 6) {
                s->source->to->beside = false;
                return kmp_modal_refuse_at(s->source, own->line, 1,
                                           "the matrix '%s' has an entry of points %d and %d, components %d and %d: "
                                           "points must be positive, components 1 to 6, or 0 of a scalar point",
                                           s->matrix[k].name, own->column.point, own->row.point, own->column.number,
                                           own->row.number);
            }
            list[all++] = own->column;
            list[all++] = own->row;
        }
    if (!list)
        return false;
    qsort(list, (size_t)all, sizeof *list, compare_components);
    ptrdiff_t kept = 0;
    for (ptrdiff_t k = 0; k < all; k++)
        if (k == 0 || compare_components(&list[k], &list[k - 1]) != 0)
            list[kept++] = list[k];
    s->components = list;
    if (kept > KMP_MODAL_MODES_MOST)
        return kmp_modal_refuse(s->source, "its matrices have %td coordinates, the most are %d: keep fewer modes", kept,
                                KMP_MODAL_MODES_MOST);
    s->count = (int)kept;
    return true;
}

/* Grid points have six components each, scalar points one. */
static bool check_points(const reading *s)
{
    for (int k = 0; k < s->count;) {
        const component *first = &s->components[k];
        int count = 0;
        while (k + count < s->count && s->components[k + count].point == first->point)
            count++;
        if (count != (first->number == 0 ? 1 : 6))
            return kmp_modal_refuse(s->source,
                                    "point %d has %d component%s, from %d on: an interface is a grid point with "
                                    "components 1 to 6 and a rigid element; a scalar point has component 0",
                                    first->point, count, count == 1 ? "" : "s", first->number);
        k += count;
    }
    return true;
}

/* The entries as a matrix n x n. */
static bool fill(reading *s, matrix kind, double **to)
{
    const int n = s->count;
    bool *given;
    double *m;
    if (!KMP_ARENA_MAKE(s->source->arena, KMP_ROOM(double, n *n, &m), KMP_ROOM(bool, n *n, &given)))
        return false;
    for (int e = 0; e < s->matrix[kind].count; e++) {
        const entry *own = &s->matrix[kind].entries[e];
        const int i = find_component(s, own->row), j = find_component(s, own->column);
        const bool mirror = s->matrix[kind].form == 6;
        if (given[i * n + j] && (!mirror || m[i * n + j] != own->value))
            return kmp_modal_refuse_at(s->source, own->line, 1,
                                       "the matrix '%s' has the entry of point %d, component %d, and point %d, "
                                       "component %d, twice",
                                       s->matrix[kind].name, own->row.point, own->row.number, own->column.point,
                                       own->column.number);
        m[i * n + j] = own->value;
        given[i * n + j] = true;
        if (mirror) {
            m[j * n + i] = own->value;
            given[j * n + i] = true;
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            const double scale = sqrt(fabs(m[i * n + i] * m[j * n + j])), off = fabs(m[i * n + j] - m[j * n + i]);
            if (off > ALIKE * scale)
                return kmp_modal_refuse_at(s->source, s->matrix[kind].line, 1,
                                           "the matrix '%s' of the form 1 is not symmetric: the entries of coordinates "
                                           "%d and %d are %.6g and %.6g; a matrix with one triangle has the form 6",
                                           s->matrix[kind].name, i + 1, j + 1, m[i * n + j], m[j * n + i]);
            m[i * n + j] = m[j * n + i] = (m[i * n + j] + m[j * n + i]) / 2;
        }
    *to = m;
    return true;
}

/* -- rigid motions ----------------------------------------------------------------------------------- */

/* Places of grid points: the places of the model, in its units, then the places of cards. */
static bool find_place(const reading *s, int point, double at[3])
{
    const kmp_modal_nodes *nodes = s->source->nodes;
    for (int k = 0; k < nodes->count; k++)
        if (nodes->number[k] == point) {
            for (int i = 0; i < 3; i++)
                at[i] = nodes->at[3 * k + i] / s->source->units->length;
            return true;
        }
    for (int k = 0; k < s->grid_count; k++)
        if (s->grids[k].number == point) {
            memcpy(at, s->grids[k].at, 3 * sizeof *at);
            return true;
        }
    return kmp_modal_refuse(
        s->source,
        "it does not say where grid point %d is: give its place by 'nodes: {%d: [x, y, z]}', or the "
        "bulk data with the cards GRID by 'nodes: NAME.bdf'",
        point, point);
}

static bool take_places(const reading *s, kmp_modal_body *b)
{
    const int n = s->count;
    for (int k = 0; k < n; k++) {
        if (s->components[k].number != 1)
            continue;
        kmp_modal_place *places = kmp_arena_room(b->arena, b->places, b->place_count, sizeof *places);
        const char **names = kmp_arena_room(b->arena, s->source->to->names, b->place_count, sizeof *names);
        kmp_modal_place own = {.more = NULL};
        if (!places || !names || !find_place(s, s->components[k].point, own.at) ||
            !KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 3 * n, &own.shift, &own.turn)))
            return false;
        for (int i = 0; i < 3; i++) {
            own.shift[n * i + k + i] = 1;
            own.turn[n * i + k + 3 + i] = 1;
        }
        b->places = places;
        s->source->to->names = names;
        names[b->place_count] = kmp_arena_printf(b->arena, "%d", s->components[k].point);
        places[b->place_count++] = own;
    }
    return b->place_count > 0 ||
           kmp_modal_refuse(s->source, "its matrices have no grid points, which are its interfaces");
}

/* Coordinates of the rigid motions, 6 x n: shapes of grid points by their places; scalar points follow without force.
 */
static bool find_rigid(const reading *s, const kmp_modal_body *b, double *rigid)
{
    const int n = s->count;
    int count = 0;
    int *scalar;
    double *l, *load;
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(int, n, &scalar), KMP_ROOM(double, n *n, &l), KMP_ROOM(double, n, &load)))
        return false;
    for (int k = 0; k < n; k++)
        if (s->components[k].number == 0)
            scalar[count++] = k;
    for (int p = 0; p < b->place_count; p++) {
        const double *x = b->places[p].at;
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            for (int e = 0; e < n; e++) { /* e_i; e_i x X and e_i */
                rigid[n * i + e] += b->places[p].shift[n * i + e];
                rigid[n * (3 + i) + e] += b->places[p].turn[n * i + e] + x[j] * b->places[p].shift[n * k + e] -
                                          x[k] * b->places[p].shift[n * j + e];
            }
        }
    }
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++)
            l[i * count + j] = b->stiffness[scalar[i] * n + scalar[j]];
    if (kmp_cholesky_factor(count, l) != 0)
        return kmp_modal_refuse(s->source, "the stiffness of its scalar points is not positive: modes with fixed "
                                           "interfaces have one");
    for (int r = 0; r < 6; r++) {
        for (int i = 0; i < count; i++) {
            load[i] = 0;
            for (int e = 0; e < n; e++)
                load[i] -= s->components[e].number == 0 ? 0 : b->stiffness[scalar[i] * n + e] * rigid[n * r + e];
        }
        kmp_cholesky_forward(count, l, load);
        kmp_cholesky_backward(count, l, load);
        for (int i = 0; i < count; i++)
            rigid[n * r + scalar[i]] = load[i];
    }
    return true;
}

/* The stiffness of a free body has no force against rigid motions. */
static bool check_rigid(const reading *s, const kmp_modal_body *b, const double *rigid)
{
    static const char *const motions[6] = {"translation along x", "translation along y", "translation along z",
                                           "rotation about x",    "rotation about y",    "rotation about z"};
    const int n = s->count;
    for (int r = 0; r < 6; r++) {
        double most = 0, scale = 0;
        for (int k = 0; k < n; k++) {
            double sum = 0, size = 0;
            for (int e = 0; e < n; e++) {
                sum += b->stiffness[k * n + e] * rigid[n * r + e];
                size += fabs(b->stiffness[k * n + e] * rigid[n * r + e]);
            }
            most = fmax(most, fabs(sum));
            scale = fmax(scale, size);
        }
        if (most > ALIKE * scale)
            return kmp_modal_refuse(
                s->source,
                "its stiffness resists the rigid %s by %.2g of its scale: the places of grid points "
                "are wrong or in other units, the body is held, or digits are missing",
                motions[r], most / scale);
    }
    return true;
}

/* The mass of rigid motions is the mass of a body, the same in all directions: m, b0, P0, S and the axial vectors of
 * Z0. */
static bool take_integrals(const reading *s, kmp_modal_body *b, const double *mass)
{
    const int n = s->count;
    double *rigid, *moved, whole[6][6] = {{0}};
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 6 * n, &rigid, &moved), KMP_ROOM(double, 3 * n, &b->field),
                        KMP_ROOM(double, 9 * n, &b->by_place), KMP_ROOM(double, 9 * n * n, &b->by_field)) ||
        !find_rigid(s, b, rigid) || !check_rigid(s, b, rigid))
        return false;
    for (int r = 0; r < 6; r++)
        for (int k = 0; k < n; k++)
            for (int e = 0; e < n; e++)
                moved[n * r + k] += mass[k * n + e] * rigid[n * r + e];
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++)
            for (int k = 0; k < n; k++)
                whole[r][c] += rigid[n * r + k] * moved[n * c + k];
    b->mass = (whole[0][0] + whole[1][1] + whole[2][2]) / 3;
    if (!(b->mass > 0))
        return kmp_modal_refuse(s->source, "the mass of its rigid motions is %.6g: it must be positive", b->mass);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        b->moment[i] = (whole[3 + k][j] - whole[3 + j][k]) / 2;
        for (int c = 0; c < 3; c++)
            if (fabs(whole[i][c] - (i == c ? b->mass : 0)) > ALIKE * b->mass)
                return kmp_modal_refuse(s->source,
                                        "its rigid mass differs between directions: %.9g, %.9g and %.9g along x, y and "
                                        "z; the places of its grid points are wrong, or masses have directions",
                                        whole[0][0], whole[1][1], whole[2][2]);
    }
    for (int i = 0; i < 9; i++)
        b->second[i] = (i % 4 == 0 ? (whole[3][3] + whole[4][4] + whole[5][5]) / 2 : 0) - whole[3 + i / 3][3 + i % 3];
    for (int k = 0; k < n; k++)
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, c = (i + 2) % 3;
            b->field[3 * k + i] = moved[n * i + k];
            b->by_place[9 * k + 3 * c + j] = moved[n * (3 + i) + k] / 2;
            b->by_place[9 * k + 3 * j + c] = -moved[n * (3 + i) + k] / 2;
        }
    for (ptrdiff_t k = 0; k < (ptrdiff_t)n * n; k++)
        for (int i = 0; i < 9; i += 4)
            b->by_field[9 * k + i] = mass[k] / 3;
    return true;
}

/* -- the file ---------------------------------------------------------------------------------------- */

static bool check_matrices(const reading *s)
{
    for (int k = 0; k < 2; k++)
        if (s->matrix[k].line == 0 || s->matrix[k].count == 0)
            return kmp_modal_refuse(s->source, "it has no matrix of %s, DMIG %s", what[k], k == 0 ? "KAAX" : "MAAX");
    for (int e = 0; e < s->matrix[LOSS].count; e++)
        if (s->matrix[LOSS].entries[e].value != 0)
            return kmp_modal_refuse_at(s->source, s->matrix[LOSS].entries[e].line, 1,
                                       "structural damping, '%s', is of harmonic motions: remove the matrix, and take "
                                       "'damping'",
                                       s->matrix[LOSS].name);
    return true;
}

bool kmp_dmig_modes_read(const kmp_modal_source *source)
{
    reading s = {.source = source};
    kmp_modal_body *b = &source->to->body;
    double *mass;
    if (!kmp_modal_is_text(source) || !kmp_modal_scaled(source) || !read_cards(&s, source->bytes))
        return false;
    s.beside = true;
    if (source->nodes->text && !read_cards(&s, source->nodes->text))
        return false;
    if (!check_matrices(&s) || !list_components(&s) || !check_points(&s))
        return false;
    b->count = s.count;
    b->known = KMP_MODAL_AXIAL;
    source->to->doubt = "its file has only the motions of interfaces: centrifugal forces on its modes are not known";
    if (!fill(&s, STIFFNESS, &b->stiffness) || !fill(&s, MASS, &mass) ||
        (s.matrix[DAMPING].count > 0 && !fill(&s, DAMPING, &b->damping)) || !take_places(&s, b) ||
        !take_integrals(&s, b, mass))
        return false;
    kmp_modal_convert(b, (double[3]){source->units->length, source->units->mass, 1});
    return !source->arena->failed;
}
