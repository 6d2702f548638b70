/* SPDX-License-Identifier: BSD-3-Clause */
/* The name of a unit in another system, factor by factor of the product; the names that were made are kept. */
#include "base/shown_units.h"
#include "base/memory.h"
#include "base/text.h"
#include <math.h>
#include <string.h>

#define INCH  0.0254             /* m */
#define POUND 0.45359237         /* kg */
#define FORCE 4.4482216152605    /* N, of a pound */
#define POWER 745.69987158227022 /* W, of 550 ft lbf/s */

/* Units of SI that other systems replace, in the order of kmp_unit_system; units.def has their definitions. */
static const struct {
    const char *si;
    kmp_shown in[KMP_UNIT_SYSTEMS];
} replaced[] = {
    {"m", {{"m", 1}, {"mm", 1000}, {"in", 1 / INCH}}},
    {"kg", {{"kg", 1}, {"kg", 1}, {"lb", 1 / POUND}}},
    {"N", {{"N", 1}, {"N", 1}, {"lbf", 1 / FORCE}}},
    {"Pa", {{"Pa", 1}, {"MPa", 1e-6}, {"psi", INCH *INCH / FORCE}}},
    {"J", {{"J", 1}, {"J", 1}, {"lbf in", 1 / (FORCE * INCH)}}},
    {"W", {{"W", 1}, {"W", 1}, {"hp", 1 / POWER}}},
};

static const char *const systems[KMP_UNIT_SYSTEMS] = {"si", "mm", "us"};

typedef struct made_unit {
    char *si;
    kmp_unit_system system;
    char *name;
    double factor;
} made_unit;

struct kmp_shown_units {
    int count;
    made_unit *list;
};

kmp_shown_units *kmp_shown_units_new(void)
{
    return KMP_NEW(kmp_shown_units, 1);
}

void kmp_shown_units_free(kmp_shown_units *made)
{
    for (int k = 0; made && k < made->count; k++) {
        kmp_free(made->list[k].si);
        kmp_free(made->list[k].name);
    }
    if (made)
        kmp_free(made->list);
    kmp_free(made);
}

kmp_unit_system kmp_unit_system_find(const char *name)
{
    int k = 0;
    while (k < KMP_UNIT_SYSTEMS && strcmp(systems[k], name) != 0)
        k++;
    return (kmp_unit_system)k;
}

const char *kmp_unit_system_name(kmp_unit_system system)
{
    return systems[system];
}

/* The word of a product as the system has it. */
static kmp_shown word_in(kmp_unit_system system, const char *word, size_t length)
{
    for (size_t k = 0; k < sizeof replaced / sizeof *replaced; k++)
        if (strlen(replaced[k].si) == length && strncmp(replaced[k].si, word, length) == 0)
            return replaced[k].in[system];
    return (kmp_shown){NULL, 1};
}

/* Writes the name of a product and finds its factor; brackets behind a stroke are one divisor, which may be a quotient.
 */
static double convert(kmp_unit_system system, const char *unit, kmp_text *name)
{
    double factor = 1, sign = 1, group = 1; /* the sign of powers of the next word, and within the brackets */
    for (const char *s = unit; *s;) {
        const size_t length = strcspn(s, " */^()");
        const kmp_shown word = word_in(system, s, length);
        double power = 1;
        if (word.unit)
            kmp_text_put(name, word.unit);
        else
            kmp_text_printf(name, "%.*s", (int)length, s);
        s += length;
        if (*s == '^') {
            const size_t digits = kmp_text_to_number(s + 1, &power);
            kmp_text_printf(name, "%.*s", (int)digits + 1, s);
            s += digits + 1;
        }
        factor *= pow(word.factor, sign * power);
        for (bool stroke = false; *s && strchr(" */()", *s); s++) {
            stroke = *s == '/' || (stroke && *s == ' ');
            sign = stroke ? -group : *s == '(' ? sign : group;
            group = *s == '(' ? sign : *s == ')' ? 1 : group;
            kmp_text_printf(name, "%c", *s);
        }
    }
    return factor;
}

/* Energies and moments over lengths are forces: "lbf in/in" is lbf, and "lbf in/in^2" is lbf/in. */
static void cancel_inches(char *name)
{
    static const char over[] = " in/in";
    char *at = strstr(name, over), *behind = at ? at + sizeof over - 1 : NULL;
    if (!at || (*behind && *behind != '^') || (*behind && (behind[1] != '2' || behind[2])))
        return;
    (void)memcpy(at, *behind ? "/in" : "", *behind ? 4 : 1);
}

kmp_shown kmp_shown_units_get(kmp_shown_units *made, kmp_shown_in in, const char *unit)
{
    static const char *const angles[][2] = {{"rad", "deg"}, {"rad/s", "deg/s"}, {"rad/s^2", "deg/s^2"}};
    for (size_t k = 0; in.degrees && k < sizeof angles / sizeof *angles; k++)
        if (strcmp(unit, angles[k][0]) == 0)
            return (kmp_shown){angles[k][1], 180 / 3.14159265358979323846};
    if (in.system == KMP_UNITS_SI || !made)
        return (kmp_shown){unit, 1};
    for (int k = 0; k < made->count; k++)
        if (made->list[k].system == in.system && strcmp(made->list[k].si, unit) == 0)
            return (kmp_shown){made->list[k].name, made->list[k].factor};
    kmp_text name = {0};
    const double factor = convert(in.system, unit, &name);
    if (name.s)
        cancel_inches(name.s);
    made_unit *list = kmp_list_room(made->list, (size_t)made->count, sizeof *list);
    made->list = list ? list : made->list;
    made_unit one = {kmp_strdup(unit), in.system, *unit ? kmp_text_take(&name) : kmp_strdup(""), factor};
    if (!list || !one.si || !one.name) {
        kmp_text_free(&name);
        kmp_free(one.si);
        kmp_free(one.name);
        return (kmp_shown){unit, 1};
    }
    list[made->count++] = one;
    return (kmp_shown){one.name, factor};
}
