"""Variables of the controller: those that motions depend on, and those that have no part in where, how fast and with
what load a motion runs.

What each is for is recalled from KUKA, System Variables, KSS 5.5 to 8.6.  Accelerations, jerks and the limits of axes
change how a motion gets to its speed, which no toolpath states; $VEL_AXIS is the speed of PTP motions, whose path is
not computed.
"""

from __future__ import annotations

SYSTEM: dict[bytes, str] = {
    b"$BASE": "base",
    b"$TOOL": "tool",
    b"$VEL": "feed",
    b"$OV_PRO": "override",
    b"$OV_ROB": "override",
    b"$OV_APPL": "override",
    b"$RED_VEL": "override",
    b"$APO": "apo",
    b"$IPO_MODE": "mode",
    b"$ORI_TYPE": "turning",
    b"$CIRC_TYPE": "turning",
    b"$CIRC_MODE": "turning",
    b"$ROBROOT": "root",
    b"$WORLD": "root",
    b"$ADVANCE": "advance",
    b"$EX_AX_IGNORE": "apart",
    b"$ASYNC_AXIS": "apart",
    b"FDAT_ACT": "record",
    b"LDAT_ACT": "record",
    b"PDAT_ACT": "record",
}
"""Variable -> the word for what it decides; see ``statement_effects``."""

INERT = frozenset(
    b"$OUT $OUT_C $OUTB $IN $ANOUT $ANIN $DIGOUT $DIGIN $DIGIN1CODE $DIGIN2CODE $DIGIN3CODE $DIGIN4CODE $DIGIN5CODE "
    b"$DIGIN6CODE $FLAG $CYCFLAG $TIMER $TIMER_STOP $TIMER_FLAG $PULSE $IOSYS_IN_TRUE $IOSYS_OUT_TRUE $IOSIM_IN "
    b"$IOSIM_OUT $IOSIM_OPT $SET_IO_SIZE $ACC $ACC_AXIS $ACC_EXTAX $ACC_CAR_LIMIT $ACC_CAR_STOP $VEL_AXIS $VEL_EXTAX "
    b"$JERK $GEAR_JERK $FILTER $ADAP_ACC $OV_JOG $INC $BWDSTART $BWD_INFO $BWD_RESTART $H_POS $H_AXIS_TOL "
    b"$H_POS_TOL $STOPNOAPROX $LOOP_MSG $LOOP_CONT $MSG_T $ERR $ERR_NR $USER_SAF $TORQMON $TORQMON_DEF $TORQMON_COM "
    b"$TORQMON_COM_DEF $TORQMON_TIME $TORQ_DIFF $TORQ_DIFF2 $COLL_ENABLE $COLL_ALARM $COLLMON $TM_CON_ALARM $WORKSPACE "
    b"$AXWORKSPACE $WBOXDISABLE $WORKSTATE $AXWORKSTATE $SOFTN_END $SOFTP_END $TOOL_DIRECTION $AX_ENERGY "
    b"$BRAKETEST_REQ_INT $BRAKETEST_REQ_EX $SEN_PINT $SEN_PINT_C $SEN_PREA $SEN_PREA_C $DATE $PING $PRO_IP $PRO_MODE "
    b"$CMD $KEYMOVE $ASYNC_EX_AX_DECOUPLE $MEAS_PULSE $TOUCH_PIN $TOUCH_PIN1 $TOUCH_PIN2 "
    b"$TRACE $NUM_IN $NUM_OUT $DATAPATH $DATA_EXPORT $ORI_CHECK $CYC_DEF $STROBE $STRING $CP_VEL_TYPE "
    b"$CPVELREDMELD $SPL_ORI_JOINT_AUTO $RVM $LAST_BUFFERING_NOT $SAFE_IBN $MOT_STOP $MOT_STOP_OPT $SEP_ASYNC_OV "
    b"$APO_DIS_PTP".split()
)


def has_unknown_effect(name: bytes) -> bool:
    """Whether a variable (upper case) is one of the controller of which nothing says what it does to motions; loads
    are looked at elsewhere."""
    return name.startswith(b"$") and not (name in SYSTEM or name in INERT or name.startswith(b"$LOAD"))
