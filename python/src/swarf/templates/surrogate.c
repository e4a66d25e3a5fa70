/* FMI 2.0 co-simulation unit of a law that was fitted to a study of cuts.

   The law: y_j = b_j + sum_k t_kj x_k + sum_i w_ij exp(-1/2 sum_k ((x_k - c_ik)/l_k)^2), with the inputs x
   scaled to 0..1 over the study's range. Outside of that range x is held at its end and a flag is set; between
   the smallest feed of the study and no feed at all forces go straight to zero.

   The chip is as thick as the tool lies below what is left of the surface that it made one revolution ago:
   s = max(s_old, feed) - feed at the start, in a ring of places around the workpiece. No memory is taken while it
   runs, and a step costs the same whatever came before. Nothing but the C library is needed. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* The few declarations of the standard (fmi2TypesPlatform.h, fmi2FunctionTypes.h) that are needed. */
typedef void *Component;
typedef const char *String;

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status;
typedef struct {
    void (*logger)(void *, String, Status, String, String, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, Status);
    void *environment;
} Callbacks;

enum { PLACES = 1024 };
enum Phase { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED };

/* All that a saved state holds: plain numbers. */
typedef struct {
    int phase, warned, in_range;
    double time, input[INPUTS], slope[INPUTS], output[OUTPUTS];
    double width, revolution, cut_length, path, first_feed, surface[PLACES];
} State;

typedef struct {
    State state;
    const Callbacks *callbacks;
    int logging;
    char name[128];
} Instance;

static void say(Instance *one, Status status, String category, String text) {
    if (one->callbacks && one->callbacks->logger && (one->logging || status >= ERROR))
        one->callbacks->logger(one->callbacks->environment, one->name, status, category, "%s", text);
}

static Status refuse(Instance *one, String text) {
    if (one) say(one, ERROR, "logStatusError", text);
    return ERROR;
}

static void law(const double x[INPUTS], double y[LAWS], double slope[LAWS]) {
    double at[DIMENSIONS];
    int i, j, k;
    for (k = 0; k < DIMENSIONS; k++) at[k] = (x[VARIED[k]] - LOW[k]) / (HIGH[k] - LOW[k]);
    for (j = 0; j < LAWS; j++) {
        y[j] = CONSTANT[j];
        slope[j] = FEED_AXIS < 0 ? 0.0 : LINEAR[FEED_AXIS < 0 ? 0 : FEED_AXIS][j];
        for (k = 0; k < DIMENSIONS; k++) y[j] += LINEAR[k][j] * at[k];
    }
    for (i = 0; i < CENTRES; i++) {
        double square = 0.0, weight, towards = 0.0;
        for (k = 0; k < DIMENSIONS; k++) {
            const double part = (at[k] - CENTRE[i][k]) * PER_LENGTH[k];
            square += part * part;
            if (k == FEED_AXIS) towards = -part * PER_LENGTH[k];
        }
        weight = exp(-0.5 * square);
        for (j = 0; j < LAWS; j++) {
            y[j] += WEIGHT[i][j] * weight;
            slope[j] += WEIGHT[i][j] * weight * towards;
        }
    }
    if (FEED_AXIS >= 0)
        for (j = 0; j < LAWS; j++) slope[j] /= HIGH[FEED_AXIS] - LOW[FEED_AXIS];
}

/* Outputs for the present inputs and a chip thickness h. */
static void evaluate(Instance *one, double h) {
    State *s = &one->state;
    double x[INPUTS], y[LAWS], slope[LAWS], share = 1.0;
    const double speed = s->input[SPEED];
    int j, k, inside = 1;
    for (k = 0; k < INPUTS; k++) {
        x[k] = k == FEED ? h : s->input[k];
        if (x[k] < LEAST[k] - TOLERANCE[k] || x[k] > MOST[k] + TOLERANCE[k]) inside = 0;
        if (k == FEED && h < LEAST[k]) share = h > 0.0 ? h / LEAST[k] : 0.0;
        x[k] = x[k] < LEAST[k] ? LEAST[k] : x[k] > MOST[k] ? MOST[k] : x[k];
    }
    if (speed <= 0.0) share = 0.0;
    law(x, y, slope);
    for (j = 0; j < LAWS; j++) {
        const double factor = PER_WIDTH[j] ? s->width / STUDY_WIDTH : 1.0;
        const double steady = PER_WIDTH[j] || !POSITIVE[j] || y[j] > 0.0 ? y[j] : 0.0;
        s->output[j] = REST[j] + share * (steady * factor - REST[j]);
        if (j == CUTTING_FORCE || j == THRUST_FORCE) {
            const double rise = h >= MOST[FEED] || share == 0.0 ? 0.0
                              : share < 1.0 ? steady * factor / LEAST[FEED] : slope[j] * factor;
            s->output[j == CUTTING_FORCE ? CUTTING_SLOPE : THRUST_SLOPE] = rise;
        }
    }
    s->output[POWER] = s->output[CUTTING_FORCE] * speed;
    s->output[SPECIFIC_ENERGY] = share > 0.0 ? s->output[CUTTING_FORCE] / (s->width * h) : 0.0;
    s->output[CUT_LENGTH] = s->cut_length;
    s->output[CHIP] = h > 0.0 ? h : 0.0;
    if (!inside && !s->warned) {
        char text[512];
        int length = snprintf(text, sizeof text, "outside the range of the study at %g s:", s->time);
        for (k = 0; k < INPUTS && length < (int)sizeof text; k++) {
            const double value = k == FEED ? h : s->input[k];
            if (value < LEAST[k] - TOLERANCE[k] || value > MOST[k] + TOLERANCE[k])
                length += snprintf(text + length, sizeof text - (size_t)length, " %s = %g is outside [%g, %g];",
                                   NAMES[k], value, LEAST[k], MOST[k]);
        }
        say(one, WARNING, "logStatusWarning", text);
    }
    s->warned = !inside;
    s->in_range = inside;
}

/* What lies above the tool's lowest point at a place: the feed less the surface left there. */
static double chip(const State *s, double feed) {
    double place, share;
    int first;
    if (s->revolution <= 0.0) return feed;
    place = fmod(s->path / s->revolution, 1.0) * PLACES;
    first = (int)place % PLACES;
    share = place - floor(place);
    return feed - (s->surface[first] * (1.0 - share) + s->surface[(first + 1) % PLACES] * share);
}

/* Leaves the surface behind the tool over a stretch of its path, at most one revolution of it. */
static void leave(State *s, double from, double to, double feed_from, double feed_to) {
    const double cell = s->revolution / PLACES;
    double number = ceil(from / cell), last = ceil(to / cell);
    if (last - number > PLACES) number = last - PLACES;
    for (; number < last; number += 1.0) {
        const double share = (number * cell - from) / (to - from);
        double *place = &s->surface[(int)fmod(number, PLACES)];
        const double feed = feed_from + share * (feed_to - feed_from);
        *place = (feed > *place ? feed : *place) - s->first_feed;
    }
}

static void begin(State *s) {
    int k;
    memset(s, 0, sizeof *s);
    for (k = 0; k < INPUTS; k++) s->input[k] = START[k];
    s->width = STUDY_WIDTH;
    s->in_range = 1;
}

EXPORT String fmi2GetTypesPlatform(void) { return "default"; }
EXPORT String fmi2GetVersion(void) { return "2.0"; }

EXPORT Status fmi2SetDebugLogging(Component c, int on, size_t count, const String categories[]) {
    (void)count;
    (void)categories;
    if (!c) return ERROR;
    ((Instance *)c)->logging = on;
    return OK;
}

EXPORT Component fmi2Instantiate(String name, int type, String guid, String place, const Callbacks *callbacks,
                                 int visible, int logging) {
    Instance *one;
    (void)place;
    (void)visible;
    if (!callbacks || !callbacks->logger || !name || !*name || !guid || strcmp(guid, GUID) != 0 || type != 1) {
        if (callbacks && callbacks->logger)
            callbacks->logger(callbacks->environment, name ? name : "", ERROR, "logStatusError", "%s",
                              "a name, the GUID of the model description and co-simulation are needed");
        return NULL;
    }
    one = calloc(1, sizeof *one);
    if (!one) return NULL;
    one->callbacks = callbacks;
    one->logging = logging;
    strncpy(one->name, name, sizeof one->name - 1);
    begin(&one->state);
    return one;
}

EXPORT void fmi2FreeInstance(Component c) { free(c); }

EXPORT Status fmi2SetupExperiment(Component c, int has_tolerance, double tolerance, double start, int has_stop,
                                  double stop) {
    Instance *one = c;
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    if (!one || one->state.phase != INSTANTIATED) return refuse(one, "set up before initialization");
    one->state.time = start;
    return OK;
}

EXPORT Status fmi2EnterInitializationMode(Component c) {
    Instance *one = c;
    if (!one || one->state.phase != INSTANTIATED) return refuse(one, "initialization comes once, first");
    one->state.phase = INITIALIZING;
    return OK;
}

EXPORT Status fmi2ExitInitializationMode(Component c) {
    Instance *one = c;
    if (!one || one->state.phase != INITIALIZING) return refuse(one, "initialization was not entered");
    one->state.phase = STEPPING;
    one->state.first_feed = one->state.input[FEED];
    evaluate(one, one->state.input[FEED]);
    return OK;
}

EXPORT Status fmi2Terminate(Component c) {
    Instance *one = c;
    if (!one || one->state.phase != STEPPING) return refuse(one, "only a running unit is terminated");
    one->state.phase = TERMINATED;
    return OK;
}

EXPORT Status fmi2Reset(Component c) {
    if (!c) return ERROR;
    begin(&((Instance *)c)->state);
    return OK;
}

static int find(const Reference list[], int count, Reference reference) {
    int k;
    for (k = 0; k < count; k++)
        if (list[k] == reference) return k;
    return -1;
}

EXPORT Status fmi2GetReal(Component c, const Reference r[], size_t count, double value[]) {
    Instance *one = c;
    size_t i;
    if (!one || (count && (!r || !value))) return refuse(one, "values are asked of nothing");
    if (one->state.phase == INITIALIZING) evaluate(one, one->state.input[FEED]);
    for (i = 0; i < count; i++) {
        int k = find(OUTPUT_REFERENCES, OUTPUTS, r[i]);
        if (k >= 0) value[i] = one->state.output[k];
        else if ((k = find(INPUT_REFERENCES, INPUTS, r[i])) >= 0) value[i] = one->state.input[k];
        else if (r[i] == WIDTH_REFERENCE) value[i] = one->state.width;
        else if (r[i] == REVOLUTION_REFERENCE) value[i] = one->state.revolution;
        else return refuse(one, "there is no Real of that reference");
    }
    return OK;
}

EXPORT Status fmi2SetReal(Component c, const Reference r[], size_t count, const double value[]) {
    Instance *one = c;
    State kept;
    size_t i;
    if (!one || (count && (!r || !value))) return refuse(one, "values are set of nothing");
    kept = one->state;
    for (i = 0; i < count; i++) {
        const int k = find(INPUT_REFERENCES, INPUTS, r[i]), fixed = one->state.phase >= STEPPING;
        int good = isfinite(value[i]) != 0;
        if (k >= 0 && good && !(fixed && k >= FREE_INPUTS)) {
            one->state.input[k] = value[i];
            one->state.slope[k] = 0.0;
        } else if (r[i] == WIDTH_REFERENCE && good && !fixed && value[i] > 0.0) one->state.width = value[i];
        else if (r[i] == REVOLUTION_REFERENCE && good && !fixed && value[i] >= 0.0) one->state.revolution = value[i];
        else {
            one->state = kept;
            return refuse(one, "no input or parameter of that reference can be set so, now");
        }
    }
    return OK;
}

EXPORT Status fmi2GetBoolean(Component c, const Reference r[], size_t count, int value[]) {
    Instance *one = c;
    size_t i;
    if (!one || (count && (!r || !value))) return refuse(one, "values are asked of nothing");
    for (i = 0; i < count; i++) {
        if (r[i] != IN_RANGE_REFERENCE) return refuse(one, "there is no Boolean of that reference");
        value[i] = one->state.in_range;
    }
    return OK;
}

#define NONE(name, kind)                                                                     \
    EXPORT Status name(Component c, const Reference r[], size_t count, kind value[]) {      \
        (void)r;                                                                             \
        (void)value;                                                                         \
        return c && !count ? OK : refuse(c, "the unit has no variable of that kind to do so"); \
    }
NONE(fmi2GetInteger, int)
NONE(fmi2GetString, String)
NONE(fmi2SetInteger, const int)
NONE(fmi2SetBoolean, const int)
NONE(fmi2SetString, const String)

EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t count, const int order[],
                                          const double value[]) {
    Instance *one = c;
    size_t i;
    if (!one || (count && (!r || !order || !value))) return refuse(one, "derivatives are set of nothing");
    for (i = 0; i < count; i++) {
        const int k = find(INPUT_REFERENCES, FREE_INPUTS, r[i]);
        if (k < 0 || order[i] != 1 || !isfinite(value[i]))
            return refuse(one, "inputs have finite derivatives of first order");
    }
    for (i = 0; i < count; i++) one->state.slope[find(INPUT_REFERENCES, FREE_INPUTS, r[i])] = value[i];
    return OK;
}

EXPORT Status fmi2DoStep(Component c, double t, double h, int no_set) {
    Instance *one = c;
    State *s;
    double feed, next, stretch;
    int k;
    (void)no_set;
    if (!one || one->state.phase != STEPPING) return refuse(one, "a step needs an initialized unit");
    s = &one->state;
    if (!(h > 0.0) || !isfinite(h) || !isfinite(t)) return refuse(one, "a step must be longer than 0 s");
    feed = s->input[FEED];
    next = feed + s->slope[FEED] * h;
    stretch = (s->input[SPEED] + 0.5 * s->slope[SPEED] * h) * h;
    /* Means over the step are those of its middle. */
    for (k = 0; k < FREE_INPUTS; k++) s->input[k] += 0.5 * s->slope[k] * h;
    s->time = t + h;
    if (stretch > 0.0) {
        const double from = s->path, to = from + stretch;
        const double middle = 0.5 * (feed + next);
        double thickness;
        s->path = from + 0.5 * stretch;
        thickness = chip(s, middle);
        s->path = to;
        if (thickness > 0.0) s->cut_length += stretch;
        if (s->revolution > 0.0) leave(s, from, to, feed, next);
        evaluate(one, thickness);
    } else evaluate(one, 0.0);
    for (k = 0; k < FREE_INPUTS; k++) s->input[k] += 0.5 * s->slope[k] * h;
    return OK;
}

EXPORT Status fmi2GetFMUstate(Component c, void **kept) {
    if (!c || !kept) return refuse(c, "a state is asked of nothing");
    if (!*kept) *kept = malloc(sizeof(State));
    if (!*kept) return refuse(c, "there is no memory for a state");
    memcpy(*kept, &((Instance *)c)->state, sizeof(State));
    return OK;
}

EXPORT Status fmi2SetFMUstate(Component c, void *kept) {
    if (!c || !kept) return refuse(c, "a state is set of nothing");
    memcpy(&((Instance *)c)->state, kept, sizeof(State));
    return OK;
}

EXPORT Status fmi2FreeFMUstate(Component c, void **kept) {
    (void)c;
    if (kept) {
        free(*kept);
        *kept = NULL;
    }
    return OK;
}

EXPORT Status fmi2SerializedFMUstateSize(Component c, void *kept, size_t *size) {
    if (!c || !kept || !size) return refuse(c, "the size of nothing is asked");
    *size = sizeof(GUID) + sizeof(State);
    return OK;
}

EXPORT Status fmi2SerializeFMUstate(Component c, void *kept, char bytes[], size_t size) {
    if (!c || !kept || !bytes || size < sizeof(GUID) + sizeof(State)) return refuse(c, "the buffer is too small");
    memcpy(bytes, GUID, sizeof(GUID));
    memcpy(bytes + sizeof(GUID), kept, sizeof(State));
    return OK;
}

EXPORT Status fmi2DeSerializeFMUstate(Component c, const char bytes[], size_t size, void **kept) {
    if (!c || !bytes || !kept || size != sizeof(GUID) + sizeof(State) || memcmp(bytes, GUID, sizeof(GUID)) != 0)
        return refuse(c, "these are no bytes of a state of this unit");
    if (!*kept) *kept = malloc(sizeof(State));
    if (!*kept) return refuse(c, "there is no memory for a state");
    memcpy(*kept, bytes + sizeof(GUID), sizeof(State));
    return OK;
}

EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference u[], size_t a, const Reference k[], size_t b,
                                           const double d[], double value[]) {
    (void)u, (void)a, (void)k, (void)b, (void)d, (void)value;
    return refuse(c, "directional derivatives are not given");
}

EXPORT Status fmi2GetRealOutputDerivatives(Component c, const Reference r[], size_t n, const int order[],
                                           double value[]) {
    (void)r, (void)order, (void)value;
    return c && !n ? OK : refuse(c, "derivatives of outputs are not given");
}

EXPORT Status fmi2CancelStep(Component c) { return refuse(c, "no step is on its way"); }

#define ASK(name, kind)                                            \
    EXPORT Status name(Component c, int what, kind *value) {      \
        (void)what;                                                \
        (void)value;                                               \
        return c ? DISCARD : ERROR;                                \
    }
ASK(fmi2GetStatus, Status)
ASK(fmi2GetIntegerStatus, int)
ASK(fmi2GetBooleanStatus, int)
ASK(fmi2GetStringStatus, String)

EXPORT Status fmi2GetRealStatus(Component c, int what, double *value) {
    if (!c || !value) return ERROR;
    if (what != 2) return DISCARD;
    *value = ((Instance *)c)->state.time;
    return OK;
}
