/* SPDX-License-Identifier: BSD-3-Clause */
/* terminalsAndIcons.xml (FMI 3). Variables that belong together are a terminal: an input with its derivatives, a
 * coordinate with its rate, the components of the position, velocity and acceleration of a point. */
#include "exchange/fmu/unit_terminals.h"
#include "exchange/fmu/unit_description.h"
#include "exchange/fmu/unit_parts.h"
#include "exchange/simulator/kempe_fmu.h"
#include <string.h>

typedef enum terminal_kind { NONE, INPUT, COORDINATE, POINT } terminal_kind;

static const char *const kind_names[] = {"", "input", "coordinate", "point"};

/* The terminal of a variable, and its name there. */
typedef struct seat {
    terminal_kind kind;
    const char *name; /* of the terminal */
    int length;       /* of its name */
    const char *member, *component;
} seat;

static seat seat_of_output(const kmp_unit_variable *v)
{
    static const char *const measures[] = {"position", "velocity", "acceleration"};
    static const char *const components[] = {".x", ".y", ".z"};
    const int length = (int)strlen(v->name);
    for (size_t k = 0; k < sizeof measures / sizeof *measures; k++) {
        const int word = (int)strlen(measures[k]);
        for (size_t i = 0; i < 3; i++)
            if (length > word + 3 && strncmp(v->name, measures[k], (size_t)word) == 0 && v->name[word] == '.' &&
                strcmp(v->name + length - 2, components[i]) == 0)
                return (seat){POINT, v->name + word + 1, length - word - 3, measures[k], components[i]};
    }
    return (seat){0};
}

static seat seat_of(const kmp_unit_variable *v)
{
    static const char *const members[] = {"value", "d", "dd"};
    const int order = (int)(v->reference % KEMPE_FMU_BLOCK) % 3;
    switch (v->reference / KEMPE_FMU_BLOCK) {
    case KEMPE_FMU_INPUTS: /* without the ending of a derivative: all three have the same order of it */
        return (seat){INPUT, v->name, (int)strlen(v->name) - (order ? order + 1 : 0), members[order], ""};
    case KEMPE_FMU_Q:
        return (seat){COORDINATE, v->name + 2, (int)strlen(v->name) - 2, "q", ""};
    case KEMPE_FMU_QD:
        return (seat){COORDINATE, v->name + 3, (int)strlen(v->name) - 3, "qd", ""};
    case KEMPE_FMU_OUTPUTS:
        return seat_of_output(v);
    default:
        return (seat){0};
    }
}

static bool is_same(const seat *a, const seat *b)
{
    return a->kind == b->kind && a->length == b->length && strncmp(a->name, b->name, (size_t)a->length) == 0;
}

/* The terminal of a variable that is the first of it. */
static void put_terminal(kmp_text *xml, const kmp_unit_variable *variables, int count, int first)
{
    const seat at = seat_of(&variables[first]);
    kmp_text name = {0};
    for (int k = 0; k < first; k++) {
        const seat other = seat_of(&variables[k]);
        if (other.kind && is_same(&at, &other))
            return;
    }
    kmp_text_printf(&name, "%s.%.*s", kind_names[at.kind], at.length, at.name);
    kmp_text_put(xml, "    <Terminal");
    kmp_unit_attribute(xml, "name", name.s);
    kmp_text_put(xml, " matchingRule=\"bus\">\n");
    for (int k = first; k < count; k++) {
        const seat other = seat_of(&variables[k]);
        if (!other.kind || !is_same(&at, &other))
            continue;
        kmp_text_put(xml, "      <TerminalMemberVariable");
        kmp_unit_attribute(xml, "variableName", variables[k].name);
        kmp_text_printf(xml, " memberName=\"%s%s\" variableKind=\"signal\"/>\n", other.member, other.component);
    }
    kmp_text_put(xml, "    </Terminal>\n");
    kmp_text_free_part(xml, &name);
}

void kmp_unit_terminals(kmp_text *xml, const kmp_unit_variable *variables, int count)
{
    bool open = false;
    kmp_text_printf(xml,
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiTerminalsAndIcons fmiVersion=\"3.0\">\n"
                    "  <GraphicalRepresentation>\n"
                    "    <CoordinateSystem x1=\"0\" y1=\"0\" x2=\"%d\" y2=\"%d\" "
                    "suggestedScalingFactorTo_mm=\"0.1\"/>\n"
                    "    <Icon x1=\"0\" y1=\"0\" x2=\"%d\" y2=\"%d\"/>\n  </GraphicalRepresentation>\n",
                    KMP_UNIT_ICON, KMP_UNIT_ICON, KMP_UNIT_ICON, KMP_UNIT_ICON);
    for (int k = 0; k < count; k++)
        if (seat_of(&variables[k]).kind) {
            kmp_text_put(xml, open ? "" : "  <Terminals>\n");
            open = true;
            put_terminal(xml, variables, count, k);
        }
    kmp_text_put(xml, open ? "  </Terminals>\n</fmiTerminalsAndIcons>\n" : "</fmiTerminalsAndIcons>\n");
}
