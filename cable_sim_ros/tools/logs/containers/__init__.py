"""Logs that hold many kinds of records: bags, ULog, XTF, tables."""
