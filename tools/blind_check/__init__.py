"""A blind check of `kr5 gap diagnose`: draws cells with known effects, and scores what is said of their recordings.

It shares no physics code with kr5 and never imports it: arm dynamics come from Pinocchio, the rest is written here from
the words of the formats. The labels go to one sealed file that the diagnosis never sees.
"""
