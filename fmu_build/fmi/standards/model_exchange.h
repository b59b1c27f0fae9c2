/* model_exchange.h - functions of Model Exchange whose names in FMI 2.0 and 3.0 differ only in the prefix, around
 * event.c. It has no include guard: fmi2_me.c and fmi3_me.c include it after calls.h with STATUS and FLAG (Boolean) of
 * their standard and NAME(SetTime) for fmi2SetTime or fmi3SetTime. */
STATUS NAME(EnterContinuousTimeMode)(void *c) {
  BEGIN(EnterContinuousTimeMode)
  return (STATUS)fmi_leave_event(i);
}

STATUS NAME(CompletedIntegratorStep)(void *c, FLAG no_set_state, FLAG *event, FLAG *terminate) {
  BEGIN(CompletedIntegratorStep)
  int asked = 0;
  (void)no_set_state;
  const fmi_status s = fmi_completed_step(i, &asked);
  if (event) *event = asked != 0;
  if (terminate) *terminate = 0;
  return (STATUS)s;
}

STATUS NAME(SetTime)(void *c, double time) {
  BEGIN(SetTime)
  return (STATUS)fmi_set_time(i, time);
}

STATUS NAME(SetContinuousStates)(void *c, const double x[], size_t n) {
  BEGIN(SetContinuousStates)
  return (STATUS)fmi_set_states(i, TABLE + CALL_SetContinuousStates, x, n);
}

STATUS NAME(GetContinuousStates)(void *c, double x[], size_t n) {
  BEGIN(GetContinuousStates)
  return (STATUS)fmi_get_states(i, TABLE + CALL_GetContinuousStates, x, n);
}

STATUS NAME(GetNominalsOfContinuousStates)(void *c, double nominals[], size_t n) {
  BEGIN(GetNominalsOfContinuousStates)
  return (STATUS)fmi_get_nominals(i, TABLE + CALL_GetNominalsOfContinuousStates, nominals, n);
}

STATUS NAME(GetEventIndicators)(void *c, double z[], size_t n) {
  BEGIN(GetEventIndicators)
  (void)z;
  return (STATUS)fmi_get_indicators(i, TABLE + CALL_GetEventIndicators, n);
}
