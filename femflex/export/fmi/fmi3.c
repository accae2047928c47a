/* FMI 3.0 (fmi-standard.org) around the linear model of model.c, for model exchange and co-simulation.
 *
 * The types are those of fmi3PlatformTypes.h and fmi3FunctionTypes.h, so that no other header is needed. Value
 * references: 0 is time; then inputs, outputs, states and their derivatives, in this order, one after another.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define NAME(name) JOIN(FMI3_FUNCTION_PREFIX, name)
#else
#define NAME(name) name
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef unsigned int Reference;
typedef const char *String;
typedef void (*LogMessage)(void *environment, fmi3Status status, String category, String message);

enum {
    FIRST_INPUT = 1,
    FIRST_OUTPUT = FIRST_INPUT + MODEL_INPUTS,
    FIRST_STATE = FIRST_OUTPUT + MODEL_OUTPUTS,
    FIRST_DERIVATIVE = FIRST_STATE + MODEL_STATES,
    END = FIRST_DERIVATIVE + MODEL_STATES
};

/* What a step needs of the past; it is all that fmi3GetFMUState keeps. */
typedef struct {
    double time, u[MODEL_INPUTS + 1], x[MODEL_STATES + 1];
} State;

typedef struct {
    State state;
    double step; /* for which the two matrices are */
    double transition[MODEL_STATES * MODEL_STATES + 1], input[MODEL_STATES * MODEL_INPUTS + 1], work[MODEL_WORK];
    void *environment;
    LogMessage log;
} Instance;

static fmi3Status failed(Instance *instance, String message)
{
    if (instance && instance->log)
        instance->log(instance->environment, fmi3Error, "error", message);
    return fmi3Error;
}

static Instance *new_instance(String token, void *environment, LogMessage log)
{
    Instance *instance = token && strcmp(token, TOKEN) == 0 ? calloc(1, sizeof(Instance)) : NULL;
    if (instance) {
        instance->environment = environment;
        instance->log = log;
    } else if (log) {
        log(environment, fmi3Error, "error", "the instantiation token is of another model, or memory is short");
    }
    return instance;
}

EXPORT String NAME(fmi3GetVersion)(void)
{
    return "3.0";
}

EXPORT fmi3Status NAME(fmi3SetDebugLogging)(void *instance, bool on, size_t n, const String categories[])
{
    (void)instance, (void)on, (void)n, (void)categories;
    return fmi3OK;
}

EXPORT void *NAME(fmi3InstantiateModelExchange)(String name, String token, String resources, bool visible, bool logging,
                                         void *environment, LogMessage log)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    return new_instance(token, environment, log);
}

EXPORT void *NAME(fmi3InstantiateCoSimulation)(String name, String token, String resources, bool visible, bool logging,
                                        bool event_mode, bool early_return, const Reference intermediate[], size_t n,
                                        void *environment, LogMessage log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n, (void)update;
    return new_instance(token, environment, log);
}

EXPORT void *NAME(fmi3InstantiateScheduledExecution)(String name, String token, String resources, bool visible, bool logging,
                                              void *environment, LogMessage log, void *clock, void *lock, void *unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    (void)clock, (void)lock, (void)unlock;
    return NULL;
}

EXPORT void NAME(fmi3FreeInstance)(void *instance)
{
    free(instance);
}

EXPORT fmi3Status NAME(fmi3EnterInitializationMode)(void *instance, bool has_tolerance, double tolerance, double start,
                                             bool has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Instance *)instance)->state.time = start;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3Reset)(void *instance)
{
    memset(&((Instance *)instance)->state, 0, sizeof(State));
    return fmi3OK;
}

#define DOES_NOTHING(name) \
    EXPORT fmi3Status NAME(name)(void *instance) \
    { \
        (void)instance; \
        return fmi3OK; \
    }
DOES_NOTHING(fmi3ExitInitializationMode)
DOES_NOTHING(fmi3EnterEventMode)
DOES_NOTHING(fmi3EnterContinuousTimeMode)
DOES_NOTHING(fmi3EnterStepMode)
DOES_NOTHING(fmi3EvaluateDiscreteStates)
DOES_NOTHING(fmi3EnterConfigurationMode)
DOES_NOTHING(fmi3ExitConfigurationMode)
DOES_NOTHING(fmi3Terminate)

EXPORT fmi3Status NAME(fmi3GetFloat64)(void *instance, const Reference references[], size_t n, double values[],
                                size_t n_values)
{
    const State *state = &((Instance *)instance)->state;
    double y[MODEL_OUTPUTS + 1], rate[MODEL_STATES + 1];
    size_t k;
    if (n != n_values)
        return failed(instance, "every variable is one number");
    model_output(state->x, state->u, y);
    model_rate(state->x, state->u, rate);
    for (k = 0; k < n; k++) {
        Reference r = references[k];
        if (r >= END)
            return failed(instance, "there is no variable of this value reference");
        values[k] = r < FIRST_INPUT    ? state->time
                    : r < FIRST_OUTPUT ? state->u[r - FIRST_INPUT]
                    : r < FIRST_STATE  ? y[r - FIRST_OUTPUT]
                    : r < FIRST_DERIVATIVE ? state->x[r - FIRST_STATE]
                                           : rate[r - FIRST_DERIVATIVE];
    }
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3SetFloat64)(void *instance, const Reference references[], size_t n, const double values[],
                                size_t n_values)
{
    State *state = &((Instance *)instance)->state;
    size_t k;
    if (n != n_values)
        return failed(instance, "every variable is one number");
    for (k = 0; k < n; k++) {
        Reference r = references[k];
        if (r >= FIRST_INPUT && r < FIRST_OUTPUT)
            state->u[r - FIRST_INPUT] = values[k];
        else if (r >= FIRST_STATE && r < FIRST_DERIVATIVE)
            state->x[r - FIRST_STATE] = values[k];
        else
            return failed(instance, "only inputs and states are set");
    }
    return fmi3OK;
}

/* model exchange */

EXPORT fmi3Status NAME(fmi3SetTime)(void *instance, double time)
{
    ((Instance *)instance)->state.time = time;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetNumberOfContinuousStates)(void *instance, size_t *n)
{
    (void)instance;
    *n = MODEL_STATES;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetNumberOfEventIndicators)(void *instance, size_t *n)
{
    (void)instance;
    *n = 0;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetEventIndicators)(void *instance, double indicators[], size_t n)
{
    (void)indicators;
    return n ? failed(instance, "the model has no events") : fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetContinuousStates)(void *instance, double states[], size_t n)
{
    if (n != MODEL_STATES)
        return failed(instance, "the model has another number of states");
    memcpy(states, ((Instance *)instance)->state.x, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3SetContinuousStates)(void *instance, const double states[], size_t n)
{
    if (n != MODEL_STATES)
        return failed(instance, "the model has another number of states");
    memcpy(((Instance *)instance)->state.x, states, n * sizeof(double));
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetContinuousStateDerivatives)(void *instance, double rates[], size_t n)
{
    const State *state = &((Instance *)instance)->state;
    if (n != MODEL_STATES)
        return failed(instance, "the model has another number of states");
    model_rate(state->x, state->u, rates);
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetNominalsOfContinuousStates)(void *instance, double nominals[], size_t n)
{
    size_t k;
    (void)instance;
    for (k = 0; k < n; k++)
        nominals[k] = 1.0;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3CompletedIntegratorStep)(void *instance, bool no_set, bool *event_mode, bool *terminate)
{
    (void)instance, (void)no_set;
    *event_mode = *terminate = false;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3UpdateDiscreteStates)(void *instance, bool *again, bool *terminate, bool *nominals, bool *values,
                                          bool *defined, double *time)
{
    (void)instance, (void)time;
    *again = *terminate = *nominals = *values = *defined = false;
    return fmi3OK;
}

/* co-simulation: exact steps, with inputs constant over each */

EXPORT fmi3Status NAME(fmi3DoStep)(void *handle, double time, double step, bool no_set, bool *event, bool *terminate,
                            bool *early, double *last)
{
    Instance *instance = handle;
    (void)no_set;
    *event = *terminate = *early = false;
    if (step != instance->step) {
        model_discretise(step, instance->transition, instance->input, instance->work);
        instance->step = step;
    }
    model_step(instance->transition, instance->input, instance->state.u, instance->state.x);
    instance->state.time = *last = time + step;
    return fmi3OK;
}

/* derivatives of outputs and rates by inputs and states: the matrices themselves */

static bool entry(Reference unknown, Reference known, double *value)
{
    bool output = unknown >= FIRST_OUTPUT && unknown < FIRST_STATE;
    bool by_input = known >= FIRST_INPUT && known < FIRST_OUTPUT;
    const double *matrix = output ? (by_input ? model_D : model_C) : (by_input ? model_B : model_A);
    size_t row = output ? unknown - FIRST_OUTPUT : unknown - FIRST_DERIVATIVE;
    size_t column = by_input ? known - FIRST_INPUT : known - FIRST_STATE;
    if (!(output || (unknown >= FIRST_DERIVATIVE && unknown < END)) ||
        !(by_input || (known >= FIRST_STATE && known < FIRST_DERIVATIVE)))
        return false;
    *value = matrix[row * (by_input ? MODEL_INPUTS : MODEL_STATES) + column];
    return true;
}

static fmi3Status derivative(void *instance, const Reference unknowns[], size_t n_unknowns, const Reference knowns[],
                             size_t n_knowns, const double seed[], double sensitivity[], bool adjoint)
{
    size_t i, j;
    double value;
    for (i = 0; i < (adjoint ? n_knowns : n_unknowns); i++)
        sensitivity[i] = 0.0;
    for (i = 0; i < n_unknowns; i++)
        for (j = 0; j < n_knowns; j++) {
            if (!entry(unknowns[i], knowns[j], &value))
                return failed(instance, "derivatives are those of outputs and rates by inputs and states");
            sensitivity[adjoint ? j : i] += value * seed[adjoint ? i : j];
        }
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3GetDirectionalDerivative)(void *instance, const Reference unknowns[], size_t n_unknowns,
                                              const Reference knowns[], size_t n_knowns, const double seed[],
                                              size_t n_seed, double sensitivity[], size_t n_sensitivity)
{
    if (n_seed != n_knowns || n_sensitivity != n_unknowns)
        return failed(instance, "every variable is one number");
    return derivative(instance, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity, false);
}

EXPORT fmi3Status NAME(fmi3GetAdjointDerivative)(void *instance, const Reference unknowns[], size_t n_unknowns,
                                          const Reference knowns[], size_t n_knowns, const double seed[],
                                          size_t n_seed, double sensitivity[], size_t n_sensitivity)
{
    if (n_seed != n_unknowns || n_sensitivity != n_knowns)
        return failed(instance, "every variable is one number");
    return derivative(instance, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity, true);
}

/* the state of an instance, kept and given back */

EXPORT fmi3Status NAME(fmi3GetFMUState)(void *instance, void **kept)
{
    if (!*kept)
        *kept = malloc(sizeof(State));
    if (!*kept)
        return failed(instance, "memory is short");
    memcpy(*kept, &((Instance *)instance)->state, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3SetFMUState)(void *instance, void *kept)
{
    memcpy(&((Instance *)instance)->state, kept, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3FreeFMUState)(void *instance, void **kept)
{
    (void)instance;
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3SerializedFMUStateSize)(void *instance, void *kept, size_t *size)
{
    (void)instance, (void)kept;
    *size = sizeof(State);
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3SerializeFMUState)(void *instance, void *kept, uint8_t bytes[], size_t size)
{
    if (size != sizeof(State))
        return failed(instance, "the state has another size");
    memcpy(bytes, kept, size);
    return fmi3OK;
}

EXPORT fmi3Status NAME(fmi3DeserializeFMUState)(void *instance, const uint8_t bytes[], size_t size, void **kept)
{
    if (size != sizeof(State) || (!*kept && !(*kept = malloc(size))))
        return failed(instance, "the state has another size, or memory is short");
    memcpy(*kept, bytes, size);
    return fmi3OK;
}

/* what the model has none of: variables of other types, clocks, dependencies that change */

#define NO_VALUES(type, word) \
    EXPORT fmi3Status NAME(fmi3Get##word)(void *instance, const Reference references[], size_t n, type values[], size_t m) \
    { \
        (void)references, (void)values, (void)m; \
        return n ? failed(instance, "there is no variable of this type") : fmi3OK; \
    } \
    EXPORT fmi3Status NAME(fmi3Set##word)(void *instance, const Reference references[], size_t n, const type values[], \
                                   size_t m) \
    { \
        (void)references, (void)values, (void)m; \
        return n ? failed(instance, "there is no variable of this type") : fmi3OK; \
    }
NO_VALUES(float, Float32)
NO_VALUES(int8_t, Int8)
NO_VALUES(uint8_t, UInt8)
NO_VALUES(int16_t, Int16)
NO_VALUES(uint16_t, UInt16)
NO_VALUES(int32_t, Int32)
NO_VALUES(uint32_t, UInt32)
NO_VALUES(int64_t, Int64)
NO_VALUES(uint64_t, UInt64)
NO_VALUES(bool, Boolean)
NO_VALUES(String, String)

static fmi3Status has_none(void *instance)
{
    return failed(instance, "the model has no clocks, binary variables, intervals or partitions");
}

EXPORT fmi3Status NAME(fmi3GetBinary)(void *instance, const Reference r[], size_t n, size_t sizes[], const uint8_t *values[],
                               size_t m)
{
    (void)r, (void)n, (void)sizes, (void)values, (void)m;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3SetBinary)(void *instance, const Reference r[], size_t n, const size_t sizes[],
                               const uint8_t *const values[], size_t m)
{
    (void)r, (void)n, (void)sizes, (void)values, (void)m;
    return has_none(instance);
}

#define NO_CLOCKS(name, type) \
    EXPORT fmi3Status NAME(name)(void *instance, const Reference r[], size_t n, type values[]) \
    { \
        (void)r, (void)n, (void)values; \
        return has_none(instance); \
    }
NO_CLOCKS(fmi3GetClock, bool)
NO_CLOCKS(fmi3SetClock, const bool)
NO_CLOCKS(fmi3GetShiftDecimal, double)
NO_CLOCKS(fmi3SetIntervalDecimal, const double)
NO_CLOCKS(fmi3SetShiftDecimal, const double)

#define NO_FRACTIONS(name, type) \
    EXPORT fmi3Status NAME(name)(void *instance, const Reference r[], size_t n, type a[], type b[]) \
    { \
        (void)r, (void)n, (void)a, (void)b; \
        return has_none(instance); \
    }
NO_FRACTIONS(fmi3GetShiftFraction, uint64_t)
NO_FRACTIONS(fmi3SetIntervalFraction, const uint64_t)
NO_FRACTIONS(fmi3SetShiftFraction, const uint64_t)

EXPORT fmi3Status NAME(fmi3GetIntervalDecimal)(void *instance, const Reference r[], size_t n, double intervals[],
                                        int qualifiers[])
{
    (void)r, (void)n, (void)intervals, (void)qualifiers;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3GetIntervalFraction)(void *instance, const Reference r[], size_t n, uint64_t counters[],
                                         uint64_t resolutions[], int qualifiers[])
{
    (void)r, (void)n, (void)counters, (void)resolutions, (void)qualifiers;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3GetNumberOfVariableDependencies)(void *instance, Reference reference, size_t *n)
{
    (void)reference, (void)n;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3GetVariableDependencies)(void *instance, Reference dependent, size_t of_dependent[],
                                             Reference independents[], size_t of_independents[], int kinds[], size_t n)
{
    (void)dependent, (void)of_dependent, (void)independents, (void)of_independents, (void)kinds, (void)n;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3GetOutputDerivatives)(void *instance, const Reference r[], size_t n, const int32_t orders[],
                                          double values[], size_t m)
{
    (void)r, (void)n, (void)orders, (void)values, (void)m;
    return has_none(instance);
}

EXPORT fmi3Status NAME(fmi3ActivateModelPartition)(void *instance, Reference clock, double time)
{
    (void)clock, (void)time;
    return has_none(instance);
}
