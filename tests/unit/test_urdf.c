/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Robots in URDF and URDF+: one file with all elements is the same model as one in Kempe's language; rotations by three
 * angles; what is refused, and what is named because it is not used. Pinocchio's numbers: tests/oracle/robots. */
#include "foreign_models.h"
#include <kempe/workspace.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define OWN KEMPE_ROOT "/tests/models/geared_leg"
#define ARM KEMPE_ROOT "/tests/models/closed_arm"

static kempe_context *context;

static void same_in_both_languages(void)
{
    foreign_same(context, OWN ".urdf", OWN ".yaml");
    foreign_same(context, ARM ".yaml", ARM "_own.yaml");
}

/* -- rotations ----------------------------------------------------------------------------------------- */

/* x turned by three successive rotations about the fixed axes x, y and z. */
static void turn(const double rpy[3], const double in[3], double out[3])
{
    double x[3] = {in[0], in[1], in[2]};
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        double s = sin(rpy[a]), k = cos(rpy[a]), was = x[b];
        x[b] = k * was - s * x[c];
        x[c] = s * was + k * x[c];
    }
    memcpy(out, x, sizeof x);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A pendulum with a turned axis and a turned tensor: M = a' I a + m |a x r|^2, and gravity's moment about the axis. */
static void turned_frames(void)
{
    static const char text[] =
        "<robot name='r'><link name='base'/><link name='arm'><inertial><origin xyz='0.3 -0.2 0.5' rpy='0.4 -0.7 1.1'/>"
        "<mass value='2'/><inertia ixx='0.3' iyy='0.4' izz='0.5' ixy='0.02' ixz='-0.03' iyz='0.01'/></inertial></link>"
        "<joint name='pin' type='revolute'><parent link='base'/><child link='arm'/><origin xyz='1 2 3' rpy='0.5 0.3 "
        "-0.9'/><axis xyz='0.6 0 0.8'/></joint></robot>";
    const double joint[3] = {0.5, 0.3, -0.9}, own[3] = {0.4, -0.7, 1.1}, r[3] = {0.3, -0.2, 0.5}, a[3] = {0.6, 0, 0.8};
    const double tensor[3][3] = {{0.3, 0.02, -0.03}, {0.02, 0.4, 0.01}, {-0.03, 0.01, 0.5}};
    double moment = 0, column[3], arm[3], axis[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* a' R I R' a, R by its columns */
            const double first[3] = {i == 0, i == 1, i == 2}, second[3] = {j == 0, j == 1, j == 2};
            double x[3], y[3];
            turn(own, first, x);
            turn(own, second, y);
            moment += dot(a, x) * tensor[i][j] * dot(y, a);
        }
    turn(joint, r, arm);
    turn(joint, a, axis);
    column[0] = axis[1] * arm[2] - axis[2] * arm[1];
    column[1] = axis[2] * arm[0] - axis[0] * arm[2];
    column[2] = axis[0] * arm[1] - axis[1] * arm[0];
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *work = NULL;
    const double q = 0, qd = 0;
    CHECK(kempe_model_read_text(context, text, "r.urdf", &model) == KEMPE_OK);
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK && kempe_workspace_new(system, &work) == KEMPE_OK);
    CHECK(work && kempe_workspace_evaluate(work, 0, &q, &qd) == KEMPE_OK);
    if (work) {
        CHECK_NEAR(kempe_workspace_mass(work)[0], moment + 2 * dot(column, column), 1e-14);
        CHECK_NEAR(kempe_workspace_bias(work)[0], 2 * 9.81 * column[2], 1e-13);
    }
    kempe_workspace_free(work);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* -- messages ------------------------------------------------------------------------------------------ */

#define LINKS "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/></inertial></link>"
#define JOINT "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/></joint>"

static void refuse(const char *text, const char *sentence)
{
    foreign_refuse(context, "r.urdf", text, sentence);
}

static void what_is_refused(void)
{
    refuse(LINKS "\n<joint name='j' type='hinge'><parent link='a'/><child link='b'/></joint></robot>",
           "r.urdf:2:1: joint type 'hinge' is unknown; available: revolute, continuous, prismatic, fixed, planar, "
           "floating, spherical");
    refuse(LINKS "\n<joint name='j' type='fixed'><parent link='a'/><child link='c'/></joint></robot>",
           "r.urdf:1:33: link 'b' is a second one without a joint to a parent\nr.urdf:2:1: link 'c' does not exist");
    refuse(LINKS JOINT "\n<joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint></robot>",
           "r.urdf:2:1: link 'b' has two joints to parents, but URDF has only trees: write one of them as a <loop> of "
           "URDF+");
    refuse(LINKS
           "\n<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 0'/></joint></robot>",
           "r.urdf:2:68: the axis of 'j' is zero: it needs a direction");
    refuse(LINKS
           "\n<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0'/></joint></robot>",
           "r.urdf:2:68: xyz '0 0' are not 3 numbers");
    refuse(LINKS
           "\n<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><mimic joint='k'/></joint></robot>",
           "r.urdf:2:69: the joint 'k' does not exist");
    refuse(LINKS JOINT "\n<loop name='l' type='screw'><predecessor link='a'/><successor link='b'/></loop></robot>",
           "r.urdf:2:1: loop type 'screw' is unknown; available: revolute, continuous, prismatic, fixed, planar, "
           "spherical");
    refuse(LINKS JOINT "\n<loop name='l' type='fixed'><predecessor link='a'/></loop></robot>",
           "r.urdf:2:1: element 'successor' is missing here");
    refuse(
        "<robot name='r'><link name='a'/><link name='a'/></robot>",
        "r.urdf:1:33: link 'a' exists twice in the model: names must be unique\nr.urdf:1:33: link 'a' is a second one "
        "without a joint to a parent");
    refuse("<robot name='r'><link name='a'/><joint name='j' type='fixed'><parent link='a'/><child "
           "link='a'/></joint></robot>",
           "r.urdf:1:1: robot 'r' has no link without a joint to a parent, to begin with");
    refuse(LINKS "\n<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint></robot>",
           "r.urdf:1:17: the mechanism cannot move: all bodies are welded to the ground; a robot that flies or floats "
           "needs a free root (--base free)");
}

static void what_is_not_used(void)
{
    CHECK_TEXT(foreign_log(context, NULL, OWN ".urdf"),
               "1 /tests/models/geared_leg.urdf:8:179: mesh 'trunk.dae' is not in the picture: a mesh is a file .stl "
               "or .obj\n"
               "1 /tests/models/geared_leg.urdf: link 'trunk' has no parent: it is fixed to the ground\n"
               "2 /tests/models/geared_leg.urdf:59:3: transmission 'drive' is not used: it has no joint\n"
               "2 /tests/models/geared_leg.urdf:9:5: 'collision' in 'link' is not used: surfaces that touch are "
               "entries of contacts\n"
               "2 /tests/models/geared_leg.urdf:30:5: 'effort' in 'limit' is not used: the torque or force of a motor "
               "is an expression\n"
               "2 /tests/models/geared_leg.urdf:30:5: 'velocity' in 'limit' is not used: the rate of a motor is an "
               "expression\n"
               "2 /tests/models/geared_leg.urdf:30:5: limits of motion are not used: --joint-limits makes them "
               "stops\n");
    foreign_strict(context, OWN ".urdf", 5);
}

/* Transmissions that are no reduction between one motor and one joint are named, and in a strict context refused. */
static void transmissions_not_used(void)
{
    static const struct {
        const char *inside, *why;
    } cases[] = {
        {"<type>transmission_interface/DifferentialTransmission</type><joint name='j'/><actuator name='m'/>",
         "it is not a reduction between one motor and one joint"},
        {"<type>SimpleTransmission</type><joint name='j'/><joint name='j'/><actuator name='m'/>",
         "it has several joints or motors"},
        {"<type>SimpleTransmission</type><joint name='j'/><actuator name='m'/><actuator name='n'/>",
         "it has several joints or motors"},
        {"<type>SimpleTransmission</type><joint name='k'/><actuator name='m'/>",
         "it moves no joint with one coordinate"},
        {"<type>SimpleTransmission</type><joint name='j'/><actuator name='j_damping'/>",
         "its motor has the name of another force"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        kmp_text text = {0}, line = {0};
        kmp_text_printf(&text,
                        "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' "
                        "iyy='1' izz='1'/></inertial></link><joint name='j' type='revolute'><parent link='a'/><child "
                        "link='b'/><dynamics damping='1'/></joint>\n<transmission name='t'>%s</transmission></robot>",
                        cases[k].inside);
        kmp_text_printf(&line, "2 r.urdf:2:1: transmission 't' is not used: %s\n", cases[k].why);
        const char *lines = foreign_log(context, text.s, "r.urdf");
        CHECK(strstr(lines, line.s) != NULL);
        if (!strstr(lines, line.s))
            printf("%s%s", lines, line.s);
        kmp_text_free(&text);
        kmp_text_free(&line);
    }
}

/* Forty kinds of parts are named, the others counted. */
static void many_are_not_used(void)
{
    kmp_text text = {0};
    kmp_text_put(&text, "<robot name='r'><link name='a'>");
    for (int k = 0; k < 60; k++)
        kmp_text_printf(&text, "\n<part%d/><again/>", k);
    kmp_text_put(&text, "</link></robot>");
    const char *lines = foreign_log(context, text.s, "r.urdf");
    CHECK(lines[0] && kempe_context_message(context)[0]);
    lines = kempe_context_message(context);
    CHECK(strstr(lines, "\nr.urdf:2:9: 'again' in 'link' is not used (60 times); without") != NULL);
    CHECK(strstr(lines, "\nr.urdf:40:1: 'part38' in 'link' is not used; ") != NULL);
    CHECK(strstr(lines, ": 'part39' and 20 parts of further kinds are not used; ") != NULL);
    CHECK(strstr(lines, "part40") == NULL);
    kmp_text_free(&text);
}

/* The coordinates of a model with a base from the context or from the file that includes the robot. */
static int coordinates_of(const char *file, const char *text)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, file, &model) == KEMPE_OK);
    int count = model ? kempe_model_coordinate_count(model) : -1;
    kempe_model_free(model);
    return count;
}

static void free_base(void)
{
    static const char robot[] = LINKS JOINT "</robot>";
    static const char inside[] = "kempe: 1\ninclude: [{file: geared_leg.urdf%s}]\n";
    const char *const keys[] = {"", ", base: free", ", base: fixed"};
    int fixed = 0;
    CHECK(coordinates_of("r.urdf", robot) == 1);
    for (int base = 0; base < 2; base++) {
        CHECK(kempe_context_set_base(context, base ? "free" : "fixed") == KEMPE_OK);
        CHECK(coordinates_of("r.urdf", robot) == (base ? 7 : 1));
        for (int k = 0; k < 3; k++) {
            char text[200];
            snprintf(text, sizeof text, inside, keys[k]);
            int count = coordinates_of(KEMPE_ROOT "/tests/models/outer.yaml", text);
            fixed = base == 0 && k == 0 ? count : fixed;
            CHECK(count == fixed + ((k == 0 ? base : k == 1) ? 6 : 0));
        }
    }
    CHECK(kempe_context_set_base(context, "loose") == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "unknown base 'loose' of robots; there are fixed and free");
    CHECK(kempe_context_set_base(context, NULL) == KEMPE_OK);
    foreign_refuse(context, "o.yaml", "kempe: 1\ninclude: [{file: r.urdf, base: loose}]\n",
                   "o.yaml:1:1: the model has no key 'bodies'\n"
                   "o.yaml:2:18: include: cannot read 'r.urdf': No such file or directory\n"
                   "o.yaml:2:32: an include: the base is fixed or free, not 'loose'");
}

/* A model that includes a robot has its gravity, unless it gives another. */
static void gravity_of_included_robot(void)
{
    static const char *const own[] = {"", "gravity: [0, 0, -1.62]\n"};
    for (int k = 0; k < 2; k++) {
        kempe_model *model = NULL;
        char text[200], *shown = NULL;
        snprintf(text, sizeof text, "kempe: 1\n%sinclude: [{file: geared_leg.urdf}]\n", own[k]);
        CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer.yaml", &model) == KEMPE_OK);
        CHECK(model && kempe_model_print(model, KEMPE_TEXT, &shown) == KEMPE_OK);
        CHECK(shown && strstr(shown, k ? "gravity [0, 0, -1.62]\n" : "gravity [0, 0, -9.81]\n"));
        kempe_text_free(shown);
        kempe_model_free(model);
    }
}

/* Limits are stops on request, of the command or of the file that includes the robot; ranges without width are none. */
static void limits_as_stops(void)
{
    static const char slide[] = LINKS
        "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/><limit lower='-0.5' "
        "upper='1e400'/></joint></robot>";
    static const char shut[] =
        LINKS "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><limit/></joint>"
              "</robot>";
    static const char *const included[] = {"", ", joint_limits: yes", ", joint_limits: no"};
    for (int asked = 0; asked < 2; asked++) {
        CHECK(kempe_context_set_joint_limits(context, asked) == KEMPE_OK);
        for (int k = 0; k < 3; k++) {
            kempe_model *model = NULL;
            char text[200], *shown = NULL;
            snprintf(text, sizeof text, "kempe: 1\ninclude: [{file: geared_leg.urdf%s}]\n", included[k]);
            CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer.yaml", &model) == KEMPE_OK);
            CHECK(model && kempe_model_print(model, KEMPE_TEXT, &shown) == KEMPE_OK);
            bool stops = k == 1 || (k == 0 && asked);
            CHECK(shown &&
                  stops == (strstr(shown, "  hip_lower: lower limit of hip, limit -1, restitution 0\n"
                                          "  hip_upper: upper limit of hip, limit 1, restitution 0\n") != NULL));
            CHECK(shown && stops == (strstr(shown, "hip_upper") != NULL));
            kempe_text_free(shown);
            kempe_model_free(model);
        }
    }
    foreign_refuse(context, "r.urdf", slide, "r.urdf:1:180: upper '1e400' is not one number");
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, shut, "r.urdf", &model) == KEMPE_OK);
    kempe_model_free(model);
    CHECK(kempe_context_set_joint_limits(context, 0) == KEMPE_OK);
}

/* Meshes beside the model, in a package above it, with one scale; others are named. */
static void meshes_that_are_found(void)
{
    static const char lost[] = "it is not found in the model's folder or a folder around it";
    static const char uneven[] = "a mesh has one positive scale";
    static const struct {
        const char *mesh, *scale, *why;
    } cases[] = {{"leg/trunk.stl", "1 1 1", NULL},
                 {"package://models/leg/trunk.stl", "2 2 2", NULL},
                 {"package://elsewhere/leg/trunk.stl", "1 1 1", NULL},
                 {"file://" KEMPE_ROOT "/tests/models/leg/trunk.stl", "1 1 1", NULL},
                 {"package://leg/hip.stl", "1 1 1", lost},
                 {"../../nowhere/trunk.stl", "1 1 1", lost},
                 {"leg/trunk.stl", "1 2 1", uneven},
                 {"leg/trunk.stl", "-1 -1 -1", uneven}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[400], wanted[400] = "";
        snprintf(text, sizeof text,
                 "<robot name='r'><link name='a'><visual><geometry><mesh filename='%s' scale='%s'/></geometry>"
                 "</visual></link></robot>",
                 cases[k].mesh, cases[k].scale);
        if (cases[k].why)
            snprintf(wanted, sizeof wanted, "1 /tests/models/r.urdf:1:50: mesh '%s' is not in the picture: %s\n",
                     cases[k].mesh, cases[k].why);
        strcat(wanted, "1 /tests/models/r.urdf: link 'a' has no parent: it is fixed to the ground\n");
        CHECK_TEXT(foreign_log(context, text, KEMPE_ROOT "/tests/models/r.urdf"), wanted);
    }
}

/* Files of loops beside closed_arm.urdf. */
static void loops_that_are_refused(void)
{
    static const struct {
        const char *text, *said;
    } cases[] = {
        {"closed_loop: [[tip, eye], [end_A, nowhere]]",
         ":1:35: the frame 'nowhere' is neither a link nor a joint of the robot"},
        {"closed_loop: [[tip, eye, end_A]]", ":1:15: an entry of 'closed_loop' is a pair of frames, [A, B]"},
        {"closed_loop: 5", ":1:14: the value of 'closed_loop' is a list of pairs of frames"},
        {"closed_loop: [[tip, eye]]\ntype: [5d]", ":2:8: type '5d' is unknown; available: 3d, 6d"},
        {"closed_loop: [[tip, eye]]\ntype: [3d, 6d]", ":2:7: the list 'type' must have one entry for each"},
        {"closed_loop: [[tip, eye]]\njoint_name: [B]", ":2:13: the list 'joint_type' is missing"},
        {"closed_loop: [[tip, eye]]\njoint_name: [B]\njoint_type: []", ":3:13: the list 'joint_type' must have one"},
        {"closed_loop: [[tip, eye]]\njoint_name: [B]\njoint_type: [UJOINT_XX]",
         ":3:14: joint_type 'UJOINT_XX' is unknown; available: FIXED, SPHERICAL, UJOINT_XY"},
        {"closed_loop: [[tip, eye]]\njoint_name: [B, B]\njoint_type: [FIXED, FIXED]",
         ":2:17: the joint 'B' is given twice"},
        {"kempe: 1\ninclude: [{file: closed_arm.urdf, joints: {C: {weld: yes}}}]",
         ":2:44: include joints: no body of '"},
    };
    kempe_model *model = NULL;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        CHECK(kempe_model_read_text(context, cases[k].text, ARM ".yaml", &model) == KEMPE_E_INPUT && !model);
        if (!strstr(kempe_context_message(context), cases[k].said))
            CHECK_TEXT(kempe_context_message(context), cases[k].said);
    }
}

/* A robot whose file has another name than that of its loops is the only one in the folder. */
static void robots_of_other_names(void)
{
    static const char robot[] =
        "<robot name='r'><link name='a'><inertial><mass value='1'/></inertial></link><link name='b'/>"
        "<joint name='A' type='floating'><parent link='b'/><child link='a'/></joint></robot>";
    char folder[] = "/tmp/kempe_robots_XXXXXX", loops[80], one[80], two[80], wanted[400];
    kempe_model *model = NULL;
    CHECK(mkdtemp(folder));
    snprintf(loops, sizeof loops, "%s/robot.yaml", folder);
    snprintf(one, sizeof one, "%s/full.urdf", folder);
    snprintf(two, sizeof two, "%s/half.urdf", folder);
    for (int count = 0; count < 3; count++) {
        if (count > 0)
            CHECK(kempe_write_file(context, count > 1 ? two : one, robot) == KEMPE_OK);
        kempe_status status = kempe_model_read_text(context, "closed_loop: [[a, b]]\ntype: [3d]", loops, &model);
        CHECK((status == KEMPE_OK) == (count == 1) && (count == 1 || status == KEMPE_E_INPUT));
        if (count == 1) {
            CHECK(kempe_model_coordinate_count(model) == 6);
            kempe_model_free(model);
            continue;
        }
        snprintf(
            wanted, sizeof wanted,
            "%s:1:1: the robot '%s/robot.urdf' of these loops cannot be read, and the folder has %s file%s with the "
            "ending .urdf",
            loops, folder, count ? "several other" : "no other", count ? "s" : "");
        CHECK_TEXT(kempe_context_message(context), wanted);
    }
    CHECK(remove(one) == 0 && remove(two) == 0 && remove(folder) == 0);
}

static void loops_not_used(void)
{
    CHECK_TEXT(foreign_log(context, NULL, ARM ".yaml"),
               "2 /tests/models/closed_arm.yaml:5:33: the joint 'absent' of joint_name is not used: the robot does not "
               "have it\n"
               "1 /tests/models/closed_arm.yaml:4:11: the motors of 'name_mot' are not used; name them in 'hold' of "
               "the start, or as many as degrees of freedom in 'independent' of the run: A\n"
               "2 /tests/models/closed_arm.yaml:14:1: 'colour' is not used; the machine differs from the file\n"
               "1 /tests/models/closed_arm.urdf: link 'base' has no parent: it is fixed to the ground\n");
    CHECK(kempe_context_set_left_out(context, NULL) == KEMPE_OK);
    foreign_strict(context, ARM ".yaml", 2);
    CHECK(kempe_context_set_left_out(context, "colour") == KEMPE_OK);
}

/* A free base of the loops is that of the robot. */
static void base_of_loops(void)
{
    kempe_model *model = NULL;
    CHECK(kempe_context_set_base(context, "free") == KEMPE_OK);
    CHECK(kempe_model_read(context, ARM ".yaml", &model) == KEMPE_OK && kempe_model_coordinate_count(model) == 18);
    kempe_model_free(model);
    CHECK(kempe_context_set_base(context, NULL) == KEMPE_OK);
}

static void changed_files(void)
{
    foreign_changed(context, "r.urdf", OWN ".urdf");
}

/* Three dialects of one loop: URDF+, Isaac Sim, Gazebo, whose joint is given in the child link and is where the parent
 * has it at zero coordinates: 0.9 - 0.3 along x, 0.125 + 0.25 along z. */
static void dialects_of_loops(void)
{
    static const char *const loops[] = {
        "<loop name='C' type='revolute'><predecessor link='b'><origin xyz='0.6 0 0.375' rpy='0 0 0.5'/></predecessor>"
        "<successor link='c'><origin xyz='0.4 0 0.25' rpy='0 0 0.5'/></successor><axis xyz='0 1 0'/></loop>",
        "<loop_joint name='C' type='revolute'><link1 link='b' xyz='0.6 0 0.375' rpy='0 0 0.5'/>"
        "<link2 link='c' xyz='0.4 0 0.25' rpy='0 0 0.5'/><axis xyz='0 1 0'/></loop_joint>",
        "<gazebo><joint name='C' type='revolute'><parent>b</parent><child>c</child><pose>0.4 0 0.25 0 0 0.5</pose>"
        "<axis><xyz>0 1 0</xyz></axis></joint></gazebo>"};
    char *wanted = NULL;
    for (size_t k = 0; k < sizeof loops / sizeof *loops; k++) {
        char text[2000], *shown = NULL;
        kempe_model *model = NULL;
        snprintf(
            text, sizeof text,
            "<robot name='r'><link name='base'/><link name='a'/><link name='b'/><link name='c'/>"
            "<joint name='A' type='continuous'><parent link='base'/><child link='a'/><origin xyz='0.1 0 0'/></joint>"
            "<joint name='B' type='continuous'><parent link='a'/><child link='b'/><origin xyz='0.2 0 0'/></joint>"
            "<joint name='D' type='continuous'><parent link='base'/><child link='c'/><origin xyz='0.5 0 0.125'/>"
            "</joint>%s</robot>",
            loops[k]);
        CHECK(kempe_model_read_text(context, text, "r.urdf", &model) == KEMPE_OK);
        CHECK(model && kempe_model_print(model, KEMPE_TEXT, &shown) == KEMPE_OK);
        if (k > 0 && wanted && shown)
            CHECK_TEXT(shown, wanted);
        if (k == 0)
            wanted = shown;
        else
            kempe_text_free(shown);
        kempe_model_free(model);
    }
    kempe_text_free(wanted);
}

int main(void)
{
    context = kempe_context_new();
    CHECK(kempe_context_set_left_out(context, "colour") == KEMPE_OK); /* of closed_arm.yaml */
    TEST(same_in_both_languages);
    TEST(turned_frames);
    TEST(what_is_refused);
    TEST(what_is_not_used);
    TEST(transmissions_not_used);
    TEST(many_are_not_used);
    TEST(dialects_of_loops);
    TEST(free_base);
    TEST(gravity_of_included_robot);
    TEST(limits_as_stops);
    TEST(meshes_that_are_found);
    TEST(loops_that_are_refused);
    TEST(robots_of_other_names);
    TEST(loops_not_used);
    TEST(base_of_loops);
    TEST(changed_files);
    kempe_context_free(context);
    return check_report();
}
