/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Constraints and forces that Drake adds to URDF and SDFormat: the same model as in Kempe's language. */
#include "foreign_models.h"

static kempe_context *context;

static const char yaml[] =
    "kempe: 1\nname: r\ngravity: [0, 0, -9.81]\nground: {points: {distance_constraint_1: [0, 1, 0]}}\nbodies:\n"
    "  a: {joint: {at: ground, weld: yes}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1, as_given: yes}, points: {origin: "
    "[0, 0, "
    "0], j: [0, 0, 0], ball_constraint_1: [0, 1, 0], linear_spring_damper_1: [0, 0, 1], linear_bushing_rpy_1: [0, 0, "
    "0]}}\n"
    "  b: {joint: {name: j, at: a.j, revolute: x}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1, as_given: yes}, points: "
    "{origin: [0, 0, 0], ball_constraint_1: [0, 1, 0], distance_constraint_1: [0, 1, 2], linear_spring_damper_1: [0, "
    "1, "
    "1], linear_bushing_rpy_1: [0, 0, 1]}}\n"
    "loops:\n  ball_constraint_1: {ball: [a.ball_constraint_1, b.ball_constraint_1]}\n"
    "  distance_constraint_1: {rod: [ground.distance_constraint_1, b.distance_constraint_1], length: 2}\n"
    "forces:\n  linear_spring_damper_1: {spring: [a.linear_spring_damper_1, b.linear_spring_damper_1], stiffness: 30, "
    "free_length: 0.5, damping: 2}\n"
    "  linear_bushing_rpy_1: {bushing: [a.linear_bushing_rpy_1, b.linear_bushing_rpy_1], stiffness: [1, 2, 3], "
    "damping: [4, "
    "5, 6], rotational_stiffness: [7, 8, 9], rotational_damping: [1, 2, 3]}\n";

/* A tag with its parts, as attributes and as texts. */
#define NAME(part, name)   "<drake:" part " name='" name "'/>"
#define VALUE(part, value) "<drake:" part " value='" value "'/>"
#define ENDS(tag, first, at, second, to)                                                                               \
    NAME(tag "_body_A", first) VALUE(tag "_p_AP", at) NAME(tag "_body_B", second) VALUE(tag "_p_BQ", to)
#define TAGS                                                                                                           \
    "<drake:ball_constraint>" ENDS(                                                                                    \
        "ball_constraint", "a", "0 1 0", "f",                                                                          \
        "0 1 -1") "</drake:ball_constraint>"                                                                           \
                  "<drake:distance_constraint>" ENDS("distance_constraint", "world", "0 1 0", "b", "0 1 2") VALUE(     \
                      "distance_constraint_distance",                                                                  \
                      "2") "</drake:distance_constraint>"                                                              \
                           "<drake:linear_spring_damper>" ENDS("linear_spring_damper", "a", "0 0 1", "f", "0 1 0")     \
                               VALUE("linear_spring_damper_stiffness", "30")                                           \
                                   VALUE("linear_spring_damper_free_length", "0.5")                                    \
                                       VALUE("linear_spring_damper_damping",                                           \
                                             "2") "</drake:linear_spring_damper>"                                      \
                                                  "<drake:linear_bushing_rpy>" NAME("bushing_frameA", "a")             \
                                                      NAME("bushing_frameC", "f")                                      \
                                                          VALUE("bushing_force_stiffness", "1 2 3")                    \
                                                              VALUE("bushing_force_damping", "4 5 6")                  \
                                                                  VALUE("bushing_torque_stiffness", "7 8 9")           \
                                                                      VALUE("bushing_torque_damping",                  \
                                                                            "1 2 3") "</drake:linear_bushing_rpy>"
#define INERTIAL "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"

static const char robot[] =
    "<robot name='r' xmlns:drake='http://drake.mit.edu'><link name='a'>" INERTIAL "</link><link name='b'>" INERTIAL
    "</link><frame name='f' link='b' xyz='0 0 1' rpy='0 0 0'/><joint name='j' type='continuous'><parent "
    "link='a'/><child "
    "link='b'/></joint>" TAGS "</robot>";

/* The tags above with their values as texts. */
static void to_texts(const char *from, char *to)
{
    const char *tag = NULL;
    while (*from) {
        const char *value = strncmp(from, " name='", 7) == 0    ? from + 7
                            : strncmp(from, " value='", 8) == 0 ? from + 8
                                                                : NULL;
        if (strncmp(from, "<drake:", 7) == 0)
            tag = from + 1;
        if (value) {
            size_t length = strcspn(value, "'"), word = strcspn(tag, " ");
            to += sprintf(to, ">%.*s</%.*s>", (int)length, value, (int)word, tag);
            from = value + length + 3;
        } else
            *to++ = *from++;
    }
    *to = '\0';
}

static char *shown(const char *label, const char *text)
{
    kempe_model *model = NULL;
    char *printed = NULL;
    if (kempe_model_read_text(context, text, label, &model) == KEMPE_OK)
        CHECK(kempe_model_print(model, KEMPE_TEXT, &printed) == KEMPE_OK);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
    return printed;
}

static void check_same(const char *label, const char *text)
{
    char *read = shown(label, text), *wanted = shown("r.yaml", yaml);
    CHECK(read && wanted);
    if (read && wanted)
        CHECK_TEXT(read, wanted);
    kempe_text_free(read);
    kempe_text_free(wanted);
}

static void in_urdf(void)
{
    check_same("r.urdf", robot);
}

static void in_sdf(void)
{
    char text[6000], *end = text;
    end += sprintf(end,
                   "<sdf version='1.9' xmlns:drake='http://drake.mit.edu'><world name='r'><gravity>0 0 -9.81</gravity>"
                   "<model name='m'><link name='a'/><link name='b'/><frame name='f' attached_to='b'><pose>0 0 1 0 0 "
                   "0</pose></frame>");
    to_texts(TAGS, end);
    strcat(text,
           "<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>"
           "</model></world></sdf>");
    kempe_model *model = NULL;
    char *read = NULL;
    CHECK(kempe_context_set_base(context, "fixed") == KEMPE_OK);
    CHECK(kempe_model_read_text(context, text, "r.sdf", &model) == KEMPE_OK);
    CHECK(model && kempe_model_print(model, KEMPE_TEXT, &read) == KEMPE_OK);
    CHECK(kempe_context_set_base(context, NULL) == KEMPE_OK);
    if (read) { /* its points have other names of joints, its constraints are the same */
        const char *loops = strstr(read, "\nloops\n"), *wanted = NULL;
        char *own = shown("r.yaml", yaml);
        wanted = own ? strstr(own, "\nloops\n") : NULL;
        CHECK(loops && wanted);
        if (loops && wanted)
            CHECK_TEXT(loops, wanted);
        kempe_text_free(own);
    }
    kempe_text_free(read);
    kempe_model_free(model);
}

static void what_is_refused(void)
{
    foreign_refuse(context, "r.urdf",
                   "<robot name='r'><link name='a'/>\n<drake:ball_constraint>" ENDS(
                       "ball_constraint", "a", "0 0 0", "c", "0 0 0") "</drake:ball_constraint>"
                                                                      "</robot>",
                   "r.urdf:2:107: link 'c' does not exist");
    foreign_refuse(
        context, "r.urdf",
        "<robot name='r'><link name='a'/>\n<drake:ball_constraint>" NAME("ball_constraint_body_A",
                                                                         "a") "</drake:ball_constraint></robot>",
        "r.urdf:2:1: element 'drake:ball_constraint_p_AP' is missing here\nr.urdf:2:1: element 'body_B' of this "
        "constraint is missing\nr.urdf:2:1: element 'drake:ball_constraint_p_BQ' is missing here");
    CHECK(strstr(foreign_log(context, robot, "r.urdf"), "2 r.urdf:1:") != NULL);
}

int main(void)
{
    context = kempe_context_new();
    TEST(in_urdf);
    TEST(in_sdf);
    TEST(what_is_refused);
    kempe_context_free(context);
    return check_report();
}
