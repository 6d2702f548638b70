/* SPDX-License-Identifier: BSD-3-Clause */
/* Names, units and columns of outputs: the words that a user wrote, in the same order, so that a printed output can be
 * read back. */
#include "model/data/output_table.h"
#include "model/data/closure.h"
#include "model/data/compliant.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"

const kmp_output_row kmp_output_rows[KMP_OUTPUT_KINDS] = {
#define KMP_OUTPUT(kind, word, argument, width, unit, meaning) {word, unit, KMP_OUTPUT_OF_##argument, width},
#include "model/data/output_kinds.def"
#undef KMP_OUTPUT
};

/* A value of an output of several. */
typedef struct shown_value {
    const char *word, *unit; /* unit NULL: of the row of the output */
} shown_value;

/* The numbers of a compliant contact; the last ones belong to a journal, z of a ball, film_x and film_y of a film. A
 * rigid contact of a journal has some of them. */
static const shown_value pressing_numbers[] = {
    {"normal", "N"}, {"friction", "N"},     {"depth", "m"}, {"rate", "m/s"}, {"slip", "m/s"}, {"x", "m"},
    {"y", "m"},      {"eccentricity", "m"}, {"z", "m"},     {"film_x", "N"}, {"film_y", "N"}};
static const int rigid_numbers[] = {0, 5, 6, 7};
/* Units of the first of them where the depth is an angle. */
static const char *const pressing_angles[] = {"N m", "N m", "rad", "rad/s", "rad/s"};

const char *kmp_output_obstacle(const kempe_model *model, kmp_output_kind kind, int point)
{
    const kmp_point *p = &model->points[point];
    const kmp_body *body = &model->bodies[p->body];
    if (kind != KMP_OUTPUT_DEFLECTION && kind != KMP_OUTPUT_SECTION && kind != KMP_OUTPUT_STRAINED &&
        kind != KMP_OUTPUT_STRESS)
        return NULL;
    if (!body->flexible)
        return "is rigid";
    const kmp_flexible *flexible = &model->flexibles[body->flexible - 1];
    if (flexible->file && kind != KMP_OUTPUT_DEFLECTION)
        return "is read from a file, which has no cross-sections: take 'reaction' and 'moment' of its joints";
    if (kind == KMP_OUTPUT_DEFLECTION || kind == KMP_OUTPUT_STRAINED || !flexible->numbers)
        return NULL;
    if (p->station > 1 && !flexible->stations[p->station - 1].beyond)
        return "has a station there whose part of the length depends on parameters, and its section divides the beam: "
               "write the station as a fixed part of the length";
    const kmp_number *section = flexible->stations[p->station > 0 ? p->station - 1 : 0].section;
    if (kind == KMP_OUTPUT_STRESS && !(section[0].value > 0 && section[1].value > 0 && section[2].value > 0))
        return "is a beam without a known section: stresses need A, Iy and Iz, by the key 'section'";
    return NULL;
}

int kmp_output_width(const kempe_model *model, const kmp_output *output)
{
    if (output->kind == KMP_OUTPUT_CONTACT)
        return KMP_CONTACT_SHOWN * kmp_wheel_contacts(&model->wheels[output->index]);
    if (output->kind != KMP_OUTPUT_FORCE)
        return kmp_output_rows[output->kind].width;
    const kmp_force *force = &model->forces[output->index];
    const int width = kmp_force_rows[force->kind].width;
    if (force->kind == KMP_FORCE_TOUCH)
        return force->touch.clearance ? width : 1;
    if (force->kind != KMP_FORCE_COMPLIANT)
        return width;
    const bool gap = force->compliant->form == KMP_COMPLIANT_GAP;
    return gap ? 5 : force->compliant->film ? width : force->compliant->ball ? width - 1 : width - 2;
}

int kmp_outputs_width(const kempe_model *model)
{
    int width = 0;
    for (int k = 0; k < model->output_count; k++)
        width += kmp_output_width(model, &model->outputs[k]);
    return width;
}

bool kmp_output_stands_alone(kmp_output_kind kind)
{
    kmp_output_argument argument = kmp_output_rows[kind].argument;
    return argument == KMP_OUTPUT_OF_NOTHING || argument == KMP_OUTPUT_OF_MAYBE_COORDINATE ||
           argument == KMP_OUTPUT_OF_MAYBE_STATE || argument == KMP_OUTPUT_OF_MAYBE_LOOP ||
           argument == KMP_OUTPUT_OF_MAYBE_BODY || argument == KMP_OUTPUT_OF_MAYBE_BODY_ABOUT;
}

bool kmp_output_equal(const kmp_output *a, const kmp_output *b)
{
    return a->kind == b->kind && a->index == b->index && a->about == b->about;
}

bool kmp_output_includes(const kmp_output *a, const kmp_output *b)
{
    return kmp_output_equal(a, b) || (a->kind == b->kind && a->index < 0 && kmp_output_rows[a->kind].width == 0);
}

kmp_name_list kmp_output_names(const kempe_model *model, kmp_output_argument argument)
{
    switch (argument) {
    case KMP_OUTPUT_OF_MAYBE_COORDINATE:
        return KMP_COORDINATES(model);
    case KMP_OUTPUT_OF_MAYBE_STATE:
        return KMP_NAMED(model, state);
    case KMP_OUTPUT_OF_MAYBE_LOOP:
    case KMP_OUTPUT_OF_LOOP:
        return KMP_NAMED(model, closure);
    case KMP_OUTPUT_OF_CUT:
        return KMP_NAMED(model, cut_coordinate);
    case KMP_OUTPUT_OF_JOINT:
        return (kmp_name_list){&model->bodies[1].joint, sizeof *model->bodies, model->body_count - 1};
    case KMP_OUTPUT_OF_POINT:
        return KMP_NAMED(model, point);
    case KMP_OUTPUT_OF_MAYBE_BODY:
    case KMP_OUTPUT_OF_MAYBE_BODY_ABOUT:
        return KMP_BODY_NAMES(model);
    case KMP_OUTPUT_OF_FORCE:
        return KMP_NAMED(model, force);
    case KMP_OUTPUT_OF_OUTLINED:
        return KMP_NAMED(model, outline_contact);
    case KMP_OUTPUT_OF_SENSOR:
        return KMP_NAMED(model, sensor);
    case KMP_OUTPUT_OF_BEARING:
        return KMP_NAMED(model, bearing);
    case KMP_OUTPUT_OF_WHEEL:
        return KMP_NAMED(model, wheel);
    case KMP_OUTPUT_OF_TYRE:
        return KMP_NAMED(model, tyre);
    case KMP_OUTPUT_OF_ROPE:
        return KMP_NAMED(model, rope);
    case KMP_OUTPUT_OF_SHEAVE:
    case KMP_OUTPUT_OF_NOTHING:
        break;
    }
    return KMP_NAMES(model->name, 0);
}

static void put_point(kmp_text *text, const kempe_model *model, int point)
{
    kmp_text_printf(text, "%s.%s", model->bodies[model->points[point].body].name, model->points[point].name);
}

/* Writes the argument in the parentheses, its words with `space` between; false when there is none. */
static bool put_argument(kmp_text *text, const kempe_model *model, const kmp_output *output, char space)
{
    kmp_output_argument argument = kmp_output_rows[output->kind].argument;
    bool any = output->index >= 0 && argument != KMP_OUTPUT_OF_NOTHING;
    if (any && argument == KMP_OUTPUT_OF_POINT)
        put_point(text, model, output->index);
    else if (any && argument == KMP_OUTPUT_OF_SHEAVE)
        kmp_text_printf(text, "%s.%d", model->ropes[output->index].name, output->about);
    else if (any)
        kmp_text_put(text, kmp_name_at(kmp_output_names(model, argument), output->index));
    if (output->about > 0 && argument != KMP_OUTPUT_OF_SHEAVE) {
        kmp_text_printf(text, "%.*sabout%c", any, &space, space);
        put_point(text, model, output->about - 1);
    }
    return any || output->about > 0;
}

void kmp_output_print(kmp_text *text, const kempe_model *model, const kmp_output *output)
{
    kmp_text argument = {0};
    bool any = put_argument(&argument, model, output, ' ');
    kmp_text_printf(text, any ? "%s(%s)" : "%s", kmp_output_rows[output->kind].word,
                    any && argument.s ? argument.s : "");
    kmp_text_free_part(text, &argument);
}

/* Values of a wheel's contact, in their order; of a wheel on its rail, and of its place; of the contact of a tyre. */
static const shown_value contact_values[KMP_CONTACT_SHOWN] = {
    {"s", "m"},           {"y", "m"},      {"angle", "rad"}, {"N", "N"},      {"creep_along", ""},
    {"creep_across", ""}, {"spin", "1/m"}, {"along", "N"},   {"across", "N"}, {"moment", "N m"},
    {"a", "m"},           {"b", "m"},      {"ellipse", ""}};
static const shown_value guidance_values[] = {{"Q", "N"}, {"Y", "N"}, {"YQ", ""}, {"wear", "N"}};
static const shown_value pose_values[KMP_POSE_SHOWN] = {
    {"out", "m"}, {"up", "m"}, {"axle_x", ""}, {"axle_y", ""}, {"axle_z", ""}};
static const shown_value tyre_values[KMP_TYRE_SHOWN] = {{"kappa", ""}, {"alpha", "rad"}, {"gamma", "rad"},
                                                        {"rho", "m"},  {"Re", "m"},      {"mu", ""}};
static const shown_value loads[] = {{"N", "N"}, {"Vy", "N"}, {"Vz", "N"}, {"Mx", "N m"}, {"My", "N m"}, {"Mz", "N m"}};
static const shown_value bearings[KMP_BEARING_VALUES] = {{"1.x", NULL}, {"1.y", NULL}, {"1.z", NULL},  {"2.x", NULL},
                                                         {"2.y", NULL}, {"2.z", NULL}, {"axial", NULL}};
static const shown_value axes[] = {{"x.x", NULL}, {"x.y", NULL}, {"x.z", NULL}, {"y.x", NULL}, {"y.y", NULL},
                                   {"y.z", NULL}, {"z.x", NULL}, {"z.y", NULL}, {"z.z", NULL}};
static const shown_value energies[] = {{"kinetic", NULL}, {"potential", NULL}, {"total", NULL}};
static const shown_value components[] = {{"x", NULL},  {"y", NULL},  {"z", NULL},
                                         {"mx", NULL}, {"my", NULL}, {"mz", NULL}};

/* Value k of an output of several; NULL: it has one. */
static const shown_value *value_of(const kempe_model *model, const kmp_output *output, int k)
{
    static const shown_value *const values[KMP_OUTPUT_KINDS] = {[KMP_OUTPUT_ENERGY] = energies,
                                                                [KMP_OUTPUT_SECTION] = loads,
                                                                [KMP_OUTPUT_STRAINED] = loads + 3,
                                                                [KMP_OUTPUT_BEARING] = bearings,
                                                                [KMP_OUTPUT_AXES] = axes,
                                                                [KMP_OUTPUT_CONTACT] = contact_values,
                                                                [KMP_OUTPUT_GUIDANCE] = guidance_values,
                                                                [KMP_OUTPUT_POSE] = pose_values,
                                                                [KMP_OUTPUT_TYRE_CONTACT] = tyre_values};
    if (values[output->kind])
        return &values[output->kind][output->kind == KMP_OUTPUT_CONTACT ? k % KMP_CONTACT_SHOWN : k];
    if (output->kind == KMP_OUTPUT_FORCE) {
        const kmp_force *force = &model->forces[output->index];
        if (force->kind == KMP_FORCE_COMPLIANT)
            return &pressing_numbers[k > 7 && !force->compliant->ball ? k + 1 : k];
        if (force->kind == KMP_FORCE_TOUCH && force->touch.clearance) /* a journal */
            return &pressing_numbers[rigid_numbers[k]];
    }
    return kmp_output_width(model, output) > 1 ? &components[k] : NULL;
}

void kmp_output_column(kmp_text *text, const kempe_model *model, const kmp_output *output, int k)
{
    const shown_value *value = value_of(model, output, k);
    kmp_text argument = {0};
    bool any = put_argument(&argument, model, output, '.');
    kmp_text_printf(text, any ? "%s.%s" : "%s", kmp_output_rows[output->kind].word,
                    any && argument.s ? argument.s : "");
    kmp_text_free_part(text, &argument);
    if (output->kind == KMP_OUTPUT_CONTACT)
        kmp_text_printf(text, ".%d", k / KMP_CONTACT_SHOWN + 1);
    if (value)
        kmp_text_printf(text, ".%s", value->word);
}

const char *kmp_output_unit(const kempe_model *model, const kmp_output *output, int k)
{
    const shown_value *value = value_of(model, output, k);
    if (output->kind == KMP_OUTPUT_FORCE) {
        /* A bushing and a wheel have three forces, then three moments; an element at a joint acts along its coordinate.
         */
        const kmp_force *force = &model->forces[output->index];
        if (force->kind == KMP_FORCE_COMPLIANT)
            return force->turns ? pressing_angles[k] : value->unit;
        if (force->kind == KMP_FORCE_TOUCH)
            return k > 0 ? "m" : force->turns ? "N m" : "N";
        bool torque = kmp_force_rows[force->kind].width > 1 ? k >= 3
                      : force->motion >= 0                  ? model->motions[force->motion].rotation
                      : force->sliding                      ? force->turns
                                       : force->kind == KMP_FORCE_BODY || force->kind == KMP_FORCE_TORSION;
        return torque ? "N m" : "N";
    }
    if (output->kind == KMP_OUTPUT_GAP)
        return model->forces[output->index].turns ? "rad" : "m";
    if (output->kind == KMP_OUTPUT_REACTION) {
        const int power = kmp_closure_effort_power(model, &model->closures[output->index]);
        return power < 0 ? "N" : kmp_multiplier_unit(power);
    }
    if (kmp_output_rows[output->kind].argument == KMP_OUTPUT_OF_CUT) {
        static const char *const units[2][3] = {{"m", "m/s", "m/s^2"}, {"rad", "rad/s", "rad/s^2"}};
        return units[model->cut_coordinates[output->index].rotation][output->kind - KMP_OUTPUT_CUT_Q];
    }
    return value && value->unit ? value->unit : kmp_output_rows[output->kind].unit;
}
