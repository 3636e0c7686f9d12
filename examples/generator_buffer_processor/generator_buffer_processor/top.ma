% Figure 1: a generator, and a buffer before a processor in a coupled model of their own.

[top]
components : Generator@Generator BUF-PROC
in : in
out : out
Link : in in@Generator
Link : out@Generator in@BUF-PROC
Link : out@BUF-PROC out

[Generator]
period : 00:00:01:000

[BUF-PROC]
components : BUF@Buffer PROC@Processor
in : in
out : out
Link : in in@BUF
Link : out@BUF in@PROC
Link : out@PROC done@BUF
Link : out@PROC out

[BUF]
preparation : 00:00:00:100

[PROC]
processing : 00:00:01:500
